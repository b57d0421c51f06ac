"""Failures of a connection, against a server under the control of the test."""

import json
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest

from bench.client import ClientError
from bench.client.session import Session
from bench.errors import LogError


class Handler(BaseHTTPRequestHandler):
    """Handler that records requests and sends the reply of its server."""

    def do_GET(self):
        self.server.requests.append((self.command, self.path, dict(self.headers)))
        status, body = self.server.reply
        self.send_response(status)
        self.send_header("Content-Length", str(self.server.announced or len(body)))
        self.end_headers()
        self.wfile.write(body)

    def do_POST(self):
        self.server.posted = self.rfile.read(int(self.headers["Content-Length"]))
        self.do_GET()

    def log_message(self, *arguments):
        pass


@pytest.fixture
def server():
    with HTTPServer(("127.0.0.1", 0), Handler) as server:
        server.requests, server.posted, server.reply, server.announced = [], None, (200, b'{"state": "idle"}'), 0
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield server
        server.shutdown()
        thread.join()


@pytest.fixture
def session(server):
    return Session(f"http://127.0.0.1:{server.server_port}/", "abc")


def test_every_request_has_the_token(session, server):
    assert session.get("/bench") == {"state": "idle"}
    assert session.post("/runs", {"method": "quick"}, key="k1") == {"state": "idle"}
    assert [(verb, path) for verb, path, _ in server.requests] == [
        ("GET", "/api/v1/bench"),
        ("POST", "/api/v1/runs"),
    ]
    assert {headers["Authorization"] for _, _, headers in server.requests} == {"Bearer abc"}
    assert server.requests[1][2]["Idempotency-Key"] == "k1"
    assert json.loads(server.posted) == {"method": "quick"}


def test_the_token_may_be_part_of_the_address(server):
    Session(f"http://127.0.0.1:{server.server_port}/#token=xyz").get("/bench")
    assert server.requests[0][2]["Authorization"] == "Bearer xyz"


def test_an_address_without_a_token_is_an_error():
    with pytest.raises(ClientError, match="the token is missing"):
        Session("http://127.0.0.1:8600")


def test_a_query_omits_what_is_not_given(session, server):
    session.get("/runs", limit=5, before=None, specimen="damper 7")
    assert server.requests[0][1] == "/api/v1/runs?limit=5&specimen=damper+7"


def test_a_refusal_by_another_server_at_the_address_is_an_error(session, server):
    server.reply = 502, b"<html>Bad Gateway</html>"
    with pytest.raises(ClientError, match="refused /bench: HTTP 502") as error:
        session.get("/bench")
    assert (error.value.status, error.value.kind) == (502, "")


def test_a_reply_that_is_not_json_is_an_error(session, server):
    server.reply = 200, b"<html>"
    with pytest.raises(ClientError, match="the reply to /bench is not JSON"):
        session.get("/bench")


def test_a_missing_service_is_an_error():
    with pytest.raises(ClientError, match=r"http://127\.0\.0\.1:9/api/v1 does not reply to /bench"):
        Session("http://127.0.0.1:9", "abc").get("/bench")


def test_a_download_that_breaks_off_is_an_error(session, server, tmp_path):
    server.announced = 10_000
    with pytest.raises(ClientError, match=r"run\.mcap: 17 of 10000 bytes of /runs/1/log arrived"):
        session.download("/runs/1/log", tmp_path / "run.mcap")
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_cannot_be_written_is_an_error(session, tmp_path):
    with pytest.raises(LogError, match=r"the folder .* does not exist; create it first"):
        session.download("/runs/1/log", tmp_path / "nowhere" / "run.mcap")


def test_a_certificate_that_cannot_be_read_is_an_error(tmp_path):
    with pytest.raises(ClientError, match="not a readable certificate"):
        Session("https://127.0.0.1:1", "abc", tmp_path / "missing.pem")


def test_a_lost_answer_is_requested_once_more_with_the_same_key(session, server):
    server.announced = 5000  # the connection ends before the announced length
    with pytest.raises(ClientError, match="broke off"):
        session.post("/runs", {}, key="k1")
    assert [headers["Idempotency-Key"] for _, _, headers in server.requests] == ["k1", "k1"]
    with pytest.raises(ClientError, match="broke off"):
        session.post("/bench/stop")
    assert len(server.requests) == 3

"""REST client of the demo, with the failures of a connection."""

import json
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest

from bench.demo.api_client import ApiClient
from bench.errors import RunError


class Handler(BaseHTTPRequestHandler):
    """Handler that records requests and sends the reply of its server."""

    def do_GET(self):
        self.server.requests.append((self.command, self.path, self.headers["Authorization"]))
        status, body = self.server.reply
        self.send_response(status)
        self.send_header("Content-Length", str(len(body)))
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
        server.requests, server.posted, server.reply = [], None, (200, b'{"state": "idle"}')
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield server
        server.shutdown()
        thread.join()


@pytest.fixture
def api(server):
    return ApiClient(f"http://127.0.0.1:{server.server_port}/#token=abc")


def test_the_token_of_the_address_is_sent_with_every_call(api, server):
    assert api.get("/bench") == {"state": "idle"}
    assert api.post("/runs", {"method": "quick"}) == {"state": "idle"}
    assert server.requests == [("GET", "/api/v1/bench", "Bearer abc"), ("POST", "/api/v1/runs", "Bearer abc")]
    assert json.loads(server.posted) == {"method": "quick"}


def test_a_refusal_carries_the_message_of_the_service(api, server):
    server.reply = 409, b'{"title": "Not possible", "detail": "the agent is tripped; reset it first"}'
    with pytest.raises(RunError, match="refused /runs: the agent is tripped; reset it first"):
        api.post("/runs", {})


def test_a_refusal_by_another_server_on_that_port_is_an_error(api, server):
    server.reply = 502, b"<html>Bad Gateway</html>"
    with pytest.raises(RunError, match="refused /bench: HTTP 502"):
        api.get("/bench")


def test_a_missing_service_is_an_error():
    with pytest.raises(RunError, match="does not reply to /bench"):
        ApiClient("http://127.0.0.1:9/#token=abc").get("/bench")


def test_a_file_is_downloaded(api, server, tmp_path):
    server.reply = 200, b"\x89MCAP" * 1000
    api.download("/runs/1/log", tmp_path / "run.mcap")
    assert (tmp_path / "run.mcap").read_bytes() == b"\x89MCAP" * 1000


def test_a_file_that_cannot_be_written_is_an_error(api, tmp_path):
    with pytest.raises(RunError, match=r"cannot be written .*; give another --out"):
        api.download("/runs/1/log", tmp_path / "nowhere" / "run.mcap")

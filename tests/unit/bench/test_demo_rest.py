"""The service as the demo's script sees it, with what can go wrong on the way."""

import json
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest

from bench.demo.rest import Rest
from bench.errors import RunError


class Answers(BaseHTTPRequestHandler):
    """Answers as its server says."""

    def do_GET(self):
        self.server.heard.append((self.command, self.path, self.headers["Authorization"]))
        status, body = self.server.answer
        self.send_response(status)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def do_POST(self):
        self.server.posted = self.rfile.read(int(self.headers["Content-Length"]))
        self.do_GET()

    def log_message(self, *words):
        pass


@pytest.fixture
def server():
    with HTTPServer(("127.0.0.1", 0), Answers) as made:
        made.heard, made.posted, made.answer = [], None, (200, b'{"state": "idle"}')
        thread = threading.Thread(target=made.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield made
        made.shutdown()
        thread.join()


@pytest.fixture
def rest(server):
    return Rest(f"http://127.0.0.1:{server.server_port}/#token=abc")


def test_the_token_of_the_address_goes_with_every_call(rest, server):
    assert rest.get("/agent") == {"state": "idle"}
    assert rest.post("/runs", {"method": "quick"}) == {"state": "idle"}
    assert server.heard == [("GET", "/api/v1/agent", "Bearer abc"), ("POST", "/api/v1/runs", "Bearer abc")]
    assert json.loads(server.posted) == {"method": "quick"}


def test_a_refusal_is_told_in_the_services_own_words(rest, server):
    server.answer = 409, b'{"title": "Not possible", "detail": "the agent is tripped; reset it first"}'
    with pytest.raises(RunError, match="refuses /runs: the agent is tripped; reset it first"):
        rest.post("/runs", {})


def test_a_refusal_of_something_else_on_that_port_is_no_traceback(rest, server):
    server.answer = 502, b"<html>Bad Gateway</html>"
    with pytest.raises(RunError, match="refuses /agent: HTTP 502"):
        rest.get("/agent")


def test_a_service_that_is_not_there_is_said():
    with pytest.raises(RunError, match="does not answer /agent"):
        Rest("http://127.0.0.1:9/#token=abc").get("/agent")


def test_a_file_is_brought_here(rest, server, tmp_path):
    server.answer = 200, b"\x89MCAP" * 1000
    rest.download("/runs/1/log", tmp_path / "run.mcap")
    assert (tmp_path / "run.mcap").read_bytes() == b"\x89MCAP" * 1000


def test_a_file_that_cannot_be_written_is_said(rest, tmp_path):
    with pytest.raises(RunError, match=r"cannot be written .*; give another --out"):
        rest.download("/runs/1/log", tmp_path / "nowhere" / "run.mcap")

"""Requests that are refused before they reach a route."""

import asyncio
import tracemalloc

import pytest

from bench.service.middleware import MAX_BODY_SIZE
from bench.service.problems import MAX_DETAIL

CHUNK = bytes(65536)


def read_problem(answer, status, name):
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["type"] == f"urn:mrbench:problem:{name}"
    return answer.json()["detail"]


def send_endless(client, headers):
    """Send a body without end to POST /runs; return the status and the number of chunks that were read."""
    chunks, sent = 0, []

    async def receive():
        nonlocal chunks
        chunks += 1
        return {"type": "http.request", "body": CHUNK, "more_body": True}

    async def send(message):
        sent.append(message)

    raw = [(name.lower().encode(), text.encode()) for name, text in headers.items()]
    scope = {
        "type": "http", "method": "POST", "path": "/api/v1/runs", "raw_path": b"/api/v1/runs", "query_string": b"",
        "headers": [(b"host", b"127.0.0.1"), (b"content-type", b"application/json"), *raw],
        "scheme": "http", "http_version": "1.1", "root_path": "", "server": ("127.0.0.1", 80), "client": None,
    }  # fmt: skip
    client.portal.call(asyncio.wait_for, client.app(scope, receive, send), 60)
    return sent[0], chunks


def test_a_body_without_token_is_refused_before_it_is_read(client):
    sent, chunks = send_endless(client, {})
    assert (sent["status"], chunks) == (401, 0)
    assert (b"connection", b"close") in sent["headers"]
    assert (b"www-authenticate", b"Bearer") in sent["headers"]


def test_a_declared_size_above_the_limit_is_refused_before_the_body_is_read(service, client):
    headers = {"Authorization": f"Bearer {service.token}", "Content-Length": str(2 * 1024**3)}
    sent, chunks = send_endless(client, headers)
    assert (sent["status"], chunks) == (413, 0)


def test_a_body_of_unknown_size_is_read_up_to_the_limit_only(service, client):
    tracemalloc.start()
    try:
        sent, chunks = send_endless(client, {"Authorization": f"Bearer {service.token}"})
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert sent["status"] == 413
    assert chunks == MAX_BODY_SIZE // len(CHUNK) + 1
    assert peak < 4 * MAX_BODY_SIZE
    assert service.agent.commands == []


def test_the_limit_is_named(client):
    answer = client.post("/api/v1/runs", content=bytes(MAX_BODY_SIZE + 1))
    assert str(MAX_BODY_SIZE) in read_problem(answer, 413, "too-large")


def test_an_invalid_document_without_token_is_refused_for_the_token(client):
    del client.headers["Authorization"]
    answer = client.post("/api/v1/runs", content="{", headers={"Content-Type": "application/json"})
    read_problem(answer, 401, "unauthorised")
    read_problem(client.get("/api/v1/nothing"), 401, "unauthorised")


@pytest.mark.parametrize("method", ["x" * 1_000_000, {"schema": "x" * 1_000_000}, {"x" * 1_000_000: 1}])
def test_an_error_quotes_a_huge_name_in_part(client, method):
    answer = client.post("/api/v1/runs", json={"method": method, "specimen": "damper 7"})
    assert answer.status_code in (404, 422)
    assert len(answer.json()["detail"]) < MAX_DETAIL + 100


def test_a_huge_path_and_query_are_quoted_in_part(client):
    for path in ("x" * 10_000, f"runs/{'x' * 10_000}", f"runs?before={'x' * 10_000}", f"methods/{'x' * 10_000}"):
        answer = client.get(f"/api/v1/{path}")
        assert "(10" in read_problem(answer, 404, "not-found")
        assert len(answer.content) < 500


@pytest.mark.parametrize("path", ["/", "/app.js", "/api/v1/health", "/api/v1/runs", "/api/v1/nothing"])
def test_every_answer_has_headers_for_browsers(client, path):
    headers = client.get(path).headers
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["x-frame-options"] == "DENY"
    assert headers["referrer-policy"] == "no-referrer"
    assert "frame-ancestors 'none'" in headers["content-security-policy"]
    assert "script-src" not in headers["content-security-policy"]
    assert headers["cache-control"] == ("no-store" if path.startswith("/api/") else "no-cache")

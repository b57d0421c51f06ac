"""Downloads of files, also of a log that grows meanwhile."""

import asyncio

import pytest

from bench.service.files import SnapshotResponse
from tests.support.service_logs import write_complete_log


@pytest.fixture
def run(service):
    run = service.post("/runs", {"method": "quick", "specimen": "damper 7"}, 201)
    write_complete_log(service.data / run["log"], run["id"])
    return run


def download(path, headers=(), method="GET"):
    """Return the header and the body that are sent of a file that doubles as soon as the header was sent."""
    sent = []

    async def send(message):
        if message["type"] == "http.response.start":
            with path.open("ab") as file:
                file.write(path.read_bytes())
        sent.append(message)

    async def receive():
        return await asyncio.Future()

    scope = {"type": "http", "method": method, "headers": list(headers), "asgi": {"spec_version": "2.3"}}
    asyncio.run(SnapshotResponse(path, "text/plain", "log")(scope, receive, send))
    head = {name.decode(): text.decode() for name, text in sent[0]["headers"]}
    return head, b"".join(message.get("body", b"") for message in sent[1:])


@pytest.mark.parametrize("size", [0, 5, 65536, 200_000])
def test_a_growing_file_is_sent_with_its_length_at_the_request(tmp_path, size):
    content = bytes(k % 251 for k in range(size))
    path = tmp_path / "log"
    path.write_bytes(content)
    head, body = download(path)
    assert head["content-length"] == str(size)
    assert body == content


def test_ranges_of_a_growing_file_are_sent(tmp_path):
    path = tmp_path / "log"
    path.write_bytes(b"0123456789")
    head, body = download(path, [(b"range", b"bytes=-4")])
    assert (head["content-range"], body) == ("bytes 6-9/10", b"6789")


def test_a_range_of_a_log_is_served(service, client, run):
    content = (service.data / run["log"]).read_bytes()
    answer = client.get(f"/api/v1/runs/{run['id']}/log", headers={"Range": "bytes=100-199"})
    assert (answer.status_code, answer.content) == (206, content[100:200])


@pytest.mark.parametrize(
    ("wanted", "status", "name"),
    [("bytes=999999999-", 416, "range-not-satisfiable"), ("bytes=a-b", 400, "bad-request")],
)
def test_an_impossible_range_is_a_problem(client, run, wanted, status, name):
    answer = client.get(f"/api/v1/runs/{run['id']}/log", headers={"Range": wanted})
    assert answer.status_code == status
    assert answer.json()["type"] == f"urn:mrbench:problem:{name}"


def test_a_log_that_was_removed_is_named(service, client, run):
    (service.data / run["log"]).unlink()
    answer = client.get(f"/api/v1/runs/{run['id']}/log")
    assert answer.status_code == 404
    assert run["id"] in answer.json()["detail"]

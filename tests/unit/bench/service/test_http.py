"""HTTP: methods of a path, HEAD, unchanged files, a service without a rig."""

import pytest

from bench.service.agent_monitor import NoAgent
from tests.support.service_logs import write_complete_log


@pytest.fixture
def log(service, client):
    write_complete_log(service.data / "one.mcap", "run-1")
    client.portal.call(client.app.state.context.registry.scan)
    return "/api/v1/runs/run-1/log"


@pytest.mark.parametrize(
    ("method", "path", "allowed"),
    [
        ("GET", "runs/run-1/stop", "POST"),
        ("PUT", "runs", "GET, HEAD, POST"),
        ("POST", "health", "GET, HEAD"),
        ("HEAD", "runs/run-1/stop", "POST"),
    ],
)  # fmt: skip
def test_a_method_that_a_path_lacks_is_refused_with_those_that_it_has(client, method, path, allowed):
    answer = client.request(method, f"/api/v1/{path}")
    assert (answer.status_code, answer.headers["allow"]) == (405, allowed)
    assert answer.headers["content-type"] == "application/problem+json"


@pytest.mark.parametrize("method", ["GET", "POST", "DELETE", "HEAD"])
def test_an_unknown_path_of_the_interface_is_not_found_for_any_method(client, method):
    answer = client.request(method, "/api/v1/nothing/here")
    assert (answer.status_code, answer.headers["content-type"]) == (404, "application/problem+json")


@pytest.mark.parametrize("path", ["runs", "runs/run-1", "runs/run-1/log", "health"])
def test_head_has_the_headers_of_get_without_its_body(client, log, path):
    head, get = (client.request(method, f"/api/v1/{path}") for method in ("HEAD", "GET"))
    assert (head.status_code, head.content) == (200, b"")
    assert {name: head.headers[name] for name in get.headers} == dict(get.headers)


def test_an_unchanged_file_is_not_sent_again(client, log):
    tag = client.get(log).headers["etag"]
    for known in (tag, f'"other", W/{tag}', "*"):
        answer = client.get(log, headers={"If-None-Match": known})
        assert (answer.status_code, answer.content, answer.headers["etag"]) == (304, b"", tag)
    assert client.get(log, headers={"If-None-Match": '"other"'}).status_code == 200


def test_a_service_without_a_rig_says_so_and_does_not_fail(service):
    answer = service.start(link=NoAgent()).get("/api/v1/bench")
    assert (answer.status_code, answer.json()["type"]) == (404, "urn:mrbench:problem:no-rig")

"""Conditional requests: 304 only for a body that has not changed, 412 only for a change by people."""

import pytest

from bench.service.requests.conditional import is_expected, is_known
from tests.support.logs import write_log

API = "/api/v1"


@pytest.fixture
def service(service):
    """Return a service with one recorded run and the job of its identification."""
    service.agent.prefix = "further"
    write_log(service.data / "one.mcap")
    service.scan()
    service.wait_for("/runs/run-1", lambda run: run["jobs"])
    return service


def get_known(service, path, tag):
    return service.client.get(f"{API}{path}", headers={"If-None-Match": tag})


@pytest.mark.parametrize("path", ["/runs/run-1", "/specimens/damper 7", "/methods/quick/1", "/methods/quick"])
def test_an_unchanged_object_is_not_sent_again(service, path):
    whole = service.client.get(f"{API}{path}")
    tag = whole.headers["etag"]
    for known in (tag, f"W/{tag}", f'"other", {tag}', "*"):
        answer = get_known(service, path, known)
        assert (answer.status_code, answer.content, answer.headers["etag"]) == (304, b"", tag)
    again = get_known(service, path, '"other"')
    assert (again.status_code, again.content) == (200, whole.content)


def test_a_job_changes_the_tag_of_its_run_but_refuses_no_change_of_its_tags(service):
    tag = service.client.get(f"{API}/runs/run-1").headers["etag"]
    (job,) = service.get("/runs/run-1")["jobs"]
    service.complete(job, {"rmse_n": 1.5, "noise_floor_n": 1.0}, {"fit.json": "{}"})
    answer = get_known(service, "/runs/run-1", tag)
    assert (answer.status_code, answer.json()["rmse_n"]) == (200, 1.5)
    body = {"author": "M. Curie", "tags": ["warm"]}
    changed = service.client.patch(f"{API}/runs/run-1", json=body, headers={"If-Match": tag})
    assert changed.status_code == 200
    assert get_known(service, "/runs/run-1", changed.headers["etag"]).status_code == 304
    assert service.client.patch(f"{API}/runs/run-1", json=body, headers={"If-Match": tag}).status_code == 412


def test_the_progress_of_a_run_changes_its_tag(service):
    run = service.post("/runs", {"method": "quick", "specimen": "damper 7"}, 201)["id"]
    service.agent.progress(1.0, "first")
    service.wait_for(f"/runs/{run}", lambda found: found["progress"]["elapsed_s"] == 1.0)
    tag = service.client.get(f"{API}/runs/{run}").headers["etag"]
    service.agent.progress(2.0, "first")
    service.wait_for(f"/runs/{run}", lambda found: found["progress"]["elapsed_s"] == 2.0)
    assert get_known(service, f"/runs/{run}", tag).status_code == 200


def test_a_further_run_changes_the_tag_of_its_specimen(service):
    tag = service.client.get(f"{API}/specimens/damper 7").headers["etag"]
    service.post("/runs", {"method": "quick", "specimen": "damper 7"}, 201)
    answer = get_known(service, "/specimens/damper 7", tag)
    assert (answer.status_code, answer.json()["runs"]) == (200, 2)
    headers = {"If-Match": tag}
    changed = service.client.patch(f"{API}/specimens/damper 7", json={"damper_kind": "RD"}, headers=headers)
    assert changed.status_code == 200


def test_a_new_version_changes_the_tag_of_the_newest_one_only(service):
    document = service.get("/methods/quick")
    tag = service.client.get(f"{API}/methods/quick").headers["etag"]
    service.post("/methods", {**document, "title": "Another title"}, 201)
    assert get_known(service, "/methods/quick", tag).json()["title"] == "Another title"
    assert get_known(service, "/methods/quick/1", tag).status_code == 304


def test_an_object_that_does_not_exist_is_not_found_with_any_tag(service):
    for path in ("/runs/none", "/specimens/none", "/methods/none", "/methods/quick/9"):
        assert get_known(service, path, "*").status_code == 404


def test_an_answer_to_a_client_with_its_tag_still_needs_the_token(service):
    del service.client.headers["Authorization"]
    assert get_known(service, "/runs/run-1", "*").status_code == 401


@pytest.mark.parametrize("known", [None, "", ",", "other", '"1"'])
def test_no_tag_and_other_tags_are_not_known(known):
    assert not is_known(known, '"1-ab"')


@pytest.mark.parametrize(
    ("expected", "answer"),
    [('"3-ab"', True), ('"3"', True), ('"1-ab", W/"3-cd"', True), ("*", True), ('"30-ab"', False), ("", False)],
)
def test_of_an_expected_tag_only_the_revision_counts(expected, answer):
    assert is_expected(expected, 3) is answer


def test_the_description_declares_304_and_the_header(client):
    paths = client.app.openapi()["paths"]
    for path in ("/runs/{run_id}", "/specimens/{serial}", "/methods/{name}", "/methods/{name}/{version}"):
        operation = paths[f"{API}{path}"]["get"]
        assert "304" in operation["responses"]
        assert "If-None-Match" in [one["name"] for one in operation["parameters"]]
    assert "304" in paths[f"{API}/runs/{{run_id}}/log"]["get"]["responses"]

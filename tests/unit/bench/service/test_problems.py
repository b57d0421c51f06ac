"""Errors have one form, name the cause and show no internals."""

import pytest

NO_METHOD = {
    "schema": "mrbench.method/1",
    "name": "wild",
    "title": "Too fast",
    "description": "Exceeds its own limits.",
    "rate_hz": 1000,
    "drive_kind": "coil_v",
    "limits": {"stroke_m": 0.02, "velocity_mps": 0.01, "acceleration_mps2": 6, "force_n": 1500, "drive": 0.5},
    "segments": [
        {
            "name": "a",
            "motion": {"kind": "sine", "amplitude_m": 0.01, "frequency_hz": 2},
            "cycles": 4,
            "drive": {"kind": "constant", "value": 0.2},
        }
    ],
}


def problem(answer, status, name):
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    content = answer.json()
    assert set(content) == {"type", "title", "status", "detail"}
    assert content["type"] == f"urn:mrbench:problem:{name}"
    assert content["status"] == status
    return content["detail"]


@pytest.mark.parametrize("path", ["runs/none", "runs/none/log", "runs/none/fit", "jobs/none", "methods/none"])
def test_a_missing_object_is_named(client, path):
    assert "none" in problem(client.get(f"/api/v1/{path}"), 404, "not-found")


def test_an_unknown_path_is_a_problem_too(client):
    assert "/api/v1/nothing" in problem(client.get("/api/v1/nothing"), 404, "not-found")


@pytest.mark.parametrize(
    ("path", "place"),
    [("runs?limit=0", "query.limit"), ("runs?limit=many", "query.limit"), ("jobs?limit=999", "limit")],
)
def test_an_invalid_query_is_named(client, path, place):
    assert place in problem(client.get(f"/api/v1/{path}"), 422, "invalid-request")


def test_an_invalid_body_is_named(client):
    answer = client.post("/api/v1/runs", json={"method": "quick", "specimen": 7})
    assert "body.specimen" in problem(answer, 422, "invalid-request")
    answer = client.post("/api/v1/runs", content="{", headers={"Content-Type": "application/json"})
    assert "JSON" in problem(answer, 422, "invalid-request")


def test_an_invalid_method_is_not_sent_to_the_agent(service, client):
    detail = problem(client.post("/api/v1/runs", json={"method": NO_METHOD}), 422, "method-refused")
    assert "0.01" in detail
    assert "m/s" in detail
    detail = problem(client.post("/api/v1/runs", json={"method": {"name": "x"}}), 422, "method-refused")
    assert "schema" in detail
    assert service.agent.commands == []


def test_the_name_of_a_method_is_never_a_file(service, client):
    (service.data / "mine.json").write_text("{}")
    for name in (str(service.data / "mine.json"), "../../../etc/passwd"):
        problem(client.post("/api/v1/runs", json={"method": name}), 404, "not-found")


def test_a_silent_agent_is_a_problem_with_a_remedy(service, client):
    service.agent.reachable = False
    for answer in (
        client.get("/api/v1/bench"),
        client.get("/api/v1/bench/instruments"),
        client.post("/api/v1/bench/reset"),
        client.post("/api/v1/runs", json={"method": "quick"}),
    ):
        assert "mrbench rig" in problem(answer, 503, "agent-unreachable")


def test_a_refusal_contains_the_message_of_the_agent(service, client):
    service.agent.refuses = "the agent is tripped (force 5100 N over 5000 N); find the cause, then reset"
    answer = client.post("/api/v1/runs", json={"method": "quick"})
    assert problem(answer, 409, "not-possible") == service.agent.refuses


def test_an_internal_error_shows_no_internals(service, client):
    service.agent.defect = ZeroDivisionError("secret /root/path")
    detail = problem(client.get("/api/v1/bench"), 500, "defect")
    assert "secret" not in detail
    assert "Zero" not in detail


def test_an_unknown_query_parameter_is_refused_and_the_known_ones_are_named(client):
    detail = problem(client.get("/api/v1/runs?specimen_name=damper"), 422, "invalid-request")
    assert "specimen_name" in detail
    assert "before, " in detail
    assert "limit" in detail
    assert "has none" in problem(client.get("/api/v1/bench/instruments?limit=1"), 422, "invalid-request")

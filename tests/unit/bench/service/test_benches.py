"""Several benches in one service: each has what belongs to it, and none disturbs another."""

import pytest
from prometheus_client.parser import text_string_to_metric_families
from starlette.websockets import WebSocketDisconnect

from bench.agent import CommandTrail
from bench.agent_protocol import (
    AbortCommand,
    AgentEvent,
    AgentStatus,
    PauseCommand,
    PrepareCommand,
    Reply,
    RunCommand,
    Sender,
)
from bench.service.benches import BenchSettings
from tests.support.audit_trails import list_all
from tests.support.certificates import make_certificate
from tests.support.fake_service import FakeAgent
from tests.support.service_logs import write_complete_log
from tests.support.waiting import wait_until
from tests.unit.bench.service.test_live import batch, batches, messages, subscribe

NAMES = ("left", "right")
PARTS = ("", "/channels", "/instruments", "/lease", "/limits")
START = {"method": "quick", "specimen": "damper 7"}
RUN = {"run": {"specimen": "MR-1", "method": "quick"}}


@pytest.fixture
def agents(service, monkeypatch):
    """Return the agents of two benches, `left` and `right`, of a service that has just begun."""
    monkeypatch.setattr("bench.service.campaigns.executor.PERIOD", 0.02)
    made = {name: FakeAgent(name) for name in NAMES}
    service.start(benches=tuple(BenchSettings(agent, name=name) for name, agent in made.items()))
    return made


def start(service, bench, **more):
    return service.post("/runs", {**START, "bench": bench, **more}, 201)


def publish(service, agents, **states):
    """Let agents publish a state, and wait until the service has it."""
    for name, state in states.items():
        agents[name].status = agents[name].status.model_copy(update={"state": state})
        agents[name].publish()
        service.wait_for("/benches", lambda found, wanted=(name, state): wanted in list_states(found))


def list_states(found):
    return [(one["name"], one["state"]) for one in found["items"]]


def finish(service, agent):
    run = agent.status.run
    write_complete_log(service.data / run.log.rpartition("/")[2], run.id)
    agent.finish()


def count(agent, kind):
    return sum(isinstance(one, kind) for one in agent.commands)


def test_the_only_bench_has_a_name_and_both_paths(service):
    service.agent.publish()
    listed = service.wait_for("/benches", lambda found: found["items"][0]["state"] == "idle")["items"]
    assert [(one["name"], one["description"], one["run"]) for one in listed] == [("bench", "idle", None)]
    for part in PARTS:
        named, only = service.get(f"/benches/bench{part}"), service.get(f"/bench{part}")
        assert named == only or part == "", part
    assert service.post("/runs", START, 201)["bench"] == "bench"


def test_each_bench_has_every_part_of_the_only_one(service, agents):
    described = service.get("/openapi.json")["paths"]
    start = "/api/v1/bench"
    only = {path.removeprefix(start): set(verbs) for path, verbs in described.items() if path.startswith(start)}
    named = {path.removeprefix("es/{name}"): verbs for path, verbs in only.items() if path.startswith("es/{name}")}
    assert len(named) >= 9
    assert named == {path: verbs for path, verbs in only.items() if not path.startswith("es")}


@pytest.mark.parametrize("path", [f"/bench{part}" for part in PARTS])
def test_the_path_of_an_only_bench_names_the_benches(service, agents, path):
    answer = service.client.get(f"/api/v1{path}")
    assert (answer.status_code, answer.json()["type"]) == (409, "urn:mrbench:problem:several-benches")
    assert "benches left, right; use /api/v1/benches/NAME/... in place of" in answer.json()["detail"]


@pytest.mark.parametrize(
    ("path", "body"), [("/bench/stop", None), ("/bench/abort", None), ("/bench/reset", None), ("/runs", START)]
)
def test_nothing_moves_without_the_name_of_a_bench(service, agents, path, body):
    assert "left, right" in service.post(path, body, 409)["detail"]
    assert [agent.commands for agent in agents.values()] == [[], []]


def test_an_unknown_bench_is_not_found(service, agents):
    assert (
        "there is no bench middle; this service has left, right"
        in service.post("/benches/middle/stop", None, 404)["detail"]
    )
    assert service.post("/runs", {**START, "bench": "middle"}, 404)["type"] == "urn:mrbench:problem:not-found"


def test_runs_of_two_benches_are_in_progress_at_once_and_found_by_bench(service, agents):
    left, right = start(service, "left"), start(service, "right")
    assert (left["bench"], right["bench"]) == NAMES
    assert left["log"] != right["log"]
    for agent in agents.values():
        agent.progress(1.5, "10mm_1Hz_0.2V")
    shown = service.wait_for("/runs", lambda found: all(run["progress"] for run in found["items"]))
    assert {run["progress"]["elapsed_s"] for run in shown["items"]} <= {0.0, 1.5}
    for name in NAMES:
        assert [run["id"] for run in service.get(f"/runs?bench={name}")["items"]] == [f"{name}-1"]
    assert service.get("/runs?bench=middle")["items"] == []
    finish(service, agents["left"])
    service.wait_for("/runs/left-1", lambda found: found["state"] == "ended")
    assert service.get("/runs/right-1")["state"] == "running"


def test_stop_abort_and_pause_reach_the_bench_of_the_run(service, agents):
    start(service, "left"), start(service, "right")
    service.post("/runs/right-1/pause")
    service.post("/runs/right-1/stop")
    assert (agents["right"].status.state, agents["left"].status.state) == ("stopping", "running")
    service.post("/runs/left-1/abort")
    assert (agents["right"].status.state, agents["left"].status.state) == ("stopping", "tripped")
    assert (count(agents["left"], PauseCommand), count(agents["left"], AbortCommand)) == (0, 1)


def test_a_run_of_a_dead_bench_is_not_stopped_on_another(service, agents):
    start(service, "left"), start(service, "right")
    agents["left"].reachable = False
    assert service.post("/runs/left-1/stop", None, 503)["type"] == "urn:mrbench:problem:agent-unreachable"
    assert agents["right"].status.state == "running"


def test_a_run_of_a_bench_that_is_no_longer_served_stops_nothing(service, agents):
    start(service, "left"), start(service, "right")
    rest = {"right": agents["right"], "third": FakeAgent("third")}
    service.start(benches=tuple(BenchSettings(agent, name=name) for name, agent in rest.items()))
    assert "no bench left" in service.post("/runs/left-1/stop", None, 404)["detail"]
    assert agents["right"].status.state == "running"


def test_a_dead_bench_disturbs_no_other(service, agents):
    agents["left"].reachable = False
    publish(service, agents, right="idle")
    listed = {one["name"]: one for one in service.get("/benches")["items"]}
    assert (listed["left"]["state"], listed["right"]["state"]) == ("unknown", "idle")
    assert "does not answer" in listed["left"]["description"]
    health = service.get("/health")
    assert health["benches"]["right"] == "ok"
    assert "no rig agent answered" in health["benches"]["left"]
    assert health["agent"].startswith("left: no rig agent answered")
    assert start(service, "right")["state"] == "running"


def test_a_bench_that_is_slow_to_answer_holds_up_no_other(service, agents):
    """One command after the other would let a stop wait for the time limit of another bench."""
    publish(service, agents, right="idle")
    slow = agents["left"].send

    def send_late(command, timeout=5.0):
        if isinstance(command, RunCommand):
            wait_until(lambda: count(agents["right"], RunCommand))
        return slow(command, timeout)

    agents["left"].send = send_late
    service.client.portal.start_task_soon(lambda: _start_in_thread(service, "left"))
    start(service, "right")
    wait_until(lambda: count(agents["left"], RunCommand))


async def _start_in_thread(service, bench):
    import asyncio

    await asyncio.to_thread(start, service, bench)


def test_the_list_says_what_each_bench_does(service, agents):
    start(service, "left")
    agents["left"].publish()
    agents["right"].status = AgentStatus(state="tripped", trip="force 1523 N exceeds 1500 N")
    agents["right"].publish()
    wanted = [("left", "running"), ("right", "tripped")]
    found = service.wait_for("/benches", lambda found: list_states(found) == wanted)
    left, right = found["items"]
    assert (left["description"], left["run"]) == ("running: quick on damper 7", "left-1")
    assert (right["description"], right["run"]) == ("tripped: force 1523 N exceeds 1500 N", None)


def test_each_listener_gets_the_samples_of_its_bench(service, agents):
    with subscribe(service, bench="left") as left, subscribe(service, bench="right") as right:
        next(messages(left, "clock")), next(messages(right, "clock"))  # both listen from now on
        for number in range(3):
            agents["left"].publish(batch(number, 1.0))
            agents["right"].publish(batch(number, 2.0))
        for socket, force in ((left, 1.0), (right, 2.0)):
            received = batches(socket)
            found = [next(received) for _ in range(3)]
            assert [(one.sequence, float(one.values[0, 0])) for one in found] == [(n, force) for n in range(3)]


def test_each_listener_hears_of_all_runs(service, agents):
    with subscribe(service, bench="left") as socket:
        next(messages(socket, "clock"))
        start(service, "right")
        assert next(messages(socket, "run"))["bench"] == "right"


@pytest.mark.parametrize("wishes", [{}, {"bench": "middle"}])
def test_a_listener_without_a_bench_is_told_the_names(service, agents, wishes):
    with subscribe(service, **wishes) as socket, pytest.raises(WebSocketDisconnect) as closed:
        socket.receive_json()
    assert (closed.value.code, "left, right" in closed.value.reason) == (4404, True)


def test_events_outside_runs_name_their_bench(service, agents):
    for name in NAMES:
        agents[name].publish(AgentEvent(time_ns=5, kind="alarm", text=f"door of {name} open"))
    service.wait_for("/events", lambda found: len(found["items"]) == 2)
    found = service.get("/events?bench=left")["items"]
    assert [(one["bench"], one["text"]) for one in found] == [("left", "door of left open")]


def test_metrics_have_the_name_of_the_bench(service, agents):
    publish(service, agents, left="idle", right="tripped")
    text = service.client.get("/api/v1/metrics").text
    samples = [one for family in text_string_to_metric_families(text) for one in family.samples]
    states = {(one.labels["bench"], one.labels["state"]) for one in samples if one.name == "mrbench_bench_state"}
    up = {one.labels["bench"]: one.value for one in samples if one.name == "mrbench_agent_up"}
    assert states == {("left", "idle"), ("right", "tripped")}
    assert up == {"left": 1.0, "right": 1.0}


def test_what_depends_on_the_bench_names_it(service, agents):
    agents["right"].description = agents["right"].description.model_copy(update={"drive_kind": "coil_a"})
    agents["right"].status = agents["right"].status.model_copy(update={"drive_kind": "coil_a"})
    publish(service, agents, right="idle")
    usable = {one["name"]: one["usable"] for one in service.get("/methods?bench=right")["items"]}
    assert usable["quick"] is False
    assert all(one["usable"] for one in service.get("/methods")["items"])
    dry = {"method": "quick", "identifiability": False}
    assert service.post("/methods/dry-run", dry)["bench"]["unknown"].endswith("name one of left, right")
    assert service.post("/methods/dry-run", {**dry, "bench": "right"})["bench"]["obstacles"] != []
    assert service.get("/checks/charts?bench=right")["method"] == "zero_check_current"


def test_a_certificate_applies_to_the_runs_of_its_bench(service, agents):
    assert "left, right" in service.post("/certificates", make_certificate(), 409)["detail"]
    stored = service.post("/certificates?bench=right", make_certificate(), 201)
    assert (stored["bench"], stored["state"]) == ("right", "valid")
    for name in NAMES:
        start(service, name)
    sent = {name: [one for one in agent.commands if isinstance(one, RunCommand)] for name, agent in agents.items()}
    named = {name: [one.id for one in commands[0].certificates] for name, commands in sent.items()}
    assert named == {"left": [], "right": [stored["id"]]}


def test_a_repeated_key_starts_one_run_on_its_bench(service, agents):
    key = {"Idempotency-Key": "k-1"}
    for _ in range(2):
        answer = service.client.post("/api/v1/runs", json={**START, "bench": "right"}, headers=key)
        assert (answer.status_code, answer.json()["id"]) == (201, "right-1")
    other = service.client.post("/api/v1/runs", json={**START, "bench": "left"}, headers=key)
    assert other.status_code == 422
    assert (count(agents["right"], RunCommand), count(agents["left"], RunCommand)) == (1, 0)


def test_campaigns_of_two_benches_run_at_the_same_time(service, agents):
    def begin(bench, status=201):
        body = {"campaign": {"name": "night", "steps": [RUN, RUN]}, "bench": bench}
        return service.post("/campaigns", body, status)

    campaigns = {name: begin(name) for name in NAMES}
    assert {name: one["bench"] for name, one in campaigns.items()} == {name: name for name in NAMES}
    for name in NAMES:
        service.wait_for(f"/campaigns/{campaigns[name]['id']}", lambda found: found["phase"] == "stroking")
        assert service.get(f"/queue?bench={name}")["campaign"]["id"] == campaigns[name]["id"]
    assert "left, right" in service.client.get("/api/v1/queue").json()["detail"]
    assert begin("left", 409)["type"] == "urn:mrbench:problem:bench-held"
    edit = {"edit": {"edit": "delete", "item": "s0002"}}
    assert service.client.patch("/api/v1/queue?bench=right", json=edit).status_code == 200
    service.post(f"/campaigns/{campaigns['left']['id']}/stop", {"now": True})
    assert (agents["left"].status.state, agents["right"].status.state) == ("stopping", "running")
    finish(service, agents["right"])
    done = service.wait_for(f"/campaigns/{campaigns['right']['id']}", lambda found: found["status"] == "done")
    assert done["items"][0]["runs"] == ["right-1"]


def test_a_trip_of_one_bench_needs_no_further_right_on_another(service, agents):
    publish(service, agents, left="tripped", right="idle")
    token = service.post("/tokens", {"label": "script", "role": "technician", "expires_in_days": 1}, 201)["token"]
    answers = {
        name: service.client.post(f"/api/v1/benches/{name}/reset", headers={"Authorization": f"Bearer {token}"})
        for name in NAMES
    }
    assert {name: answer.status_code for name, answer in answers.items()} == {"left": 403, "right": 200}


def test_the_trails_of_all_agents_are_imported(service, agents, tmp_path, monkeypatch):
    monkeypatch.setattr("bench.service.audit.agent_import.PERIOD", 0.02)
    done = Reply(ok=True, status=AgentStatus(state="idle"))
    trails = {name: CommandTrail(tmp_path / f"{name}.jsonl") for name in NAMES}
    with trails["left"], trails["right"]:
        for name, trail in trails.items():
            trail.record(PrepareCommand(step="home", sender=Sender(actor=f"local:{name}")), "p", done, wait=True)
            agents[name].trail = trail
        service.start(benches=tuple(BenchSettings(agents[name], name=name) for name in NAMES))
        own = service.data / "audit.jsonl"
        wait_until(lambda: {"local:left", "local:right"} <= {one.actor for one in list_all(own)})
        sources = [(one.source.chain, one.source.seq) for one in list_all(own) if one.source is not None]
        assert len(set(sources)) == len(sources)
        assert len({chain for chain, _ in sources}) == 2
        service.end()


def test_a_request_to_a_bench_is_recorded_with_its_name(service, agents):
    service.post("/benches/left/stop")
    service.post("/runs", {**START, "bench": "right"}, 201)
    own = service.data / "audit.jsonl"
    wait_until(
        lambda: ("POST /benches/{name}/stop", "left") in {(one.action, one.target) for one in list_all(own)}
    )
    assert {one.new["bench"] for one in list_all(own) if one.action == "POST /runs"} == {"right"}


def test_an_altered_trail_names_its_bench(service, agents):
    service.client.app.state.context.audit._imports["right"].obstacle = "the trail was altered"
    assert service.get("/health")["audit"] == "right: the trail was altered"

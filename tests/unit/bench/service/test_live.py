"""Websocket, and the messages that a slow client misses."""

import math
import time
from contextlib import contextmanager

import numpy as np
import orjson
import pytest

from bench.agent_protocol import AgentEvent, RunCommand
from bench.catalogue import CatalogueUnavailableError
from bench.jobs.progress import JobProgress
from bench.live import Channel, LiveBatch, decode_batch, parse_channels
from bench.live.listener import MAX_QUEUED_BATCHES, MAX_UNACKNOWLEDGED
from bench.methods import load_method
from bench.service import run_registry
from tests.support.service_logs import write_complete_log
from tests.support.waiting import wait_until

LIVE = "ws://127.0.0.1:8600/api/v1/live"


def batch(sequence, *force, utc_s=100.0):
    return LiveBatch(sequence, utc_s, 1e-3, (Channel("force", "N"),), np.array([force], np.float32))


def messages(socket, topic):
    while True:
        received = socket.receive()
        if received.get("text") is None:
            continue
        message = orjson.loads(received["text"])
        assert set(message) == {"topic", "data"}
        if message["topic"] == topic:
            yield message["data"]


def batches(socket):
    channels = ()
    while True:
        received = socket.receive()
        if received.get("bytes") is not None:
            yield decode_batch(received["bytes"], channels)
        elif (message := orjson.loads(received["text"]))["topic"] == "channels":
            channels = parse_channels(message["data"]["channels"])


@contextmanager
def subscribe(service, **wishes):
    with service.client.websocket_connect(LIVE) as socket:
        socket.send_json({"token": service.token, **wishes})
        yield socket


def test_messages_of_the_agent_arrive_on_the_websocket(service):
    with subscribe(service) as socket:
        service.agent.publish()
        assert next(messages(socket, "status"))["state"] == "idle"
        service.agent.publish(AgentEvent(time_ns=5, kind="alarm", text="temperature 61 degC over 60 degC"))
        assert next(messages(socket, "event"))["kind"] == "alarm"
        service.agent.publish(batch(7, 3.0, math.nan))
        found = next(batches(socket))
        assert (found.sequence, found.utc_s, found.channels) == (7, 100.0, (("force", "N"),))
        np.testing.assert_array_equal(found.values, [[3.0, math.nan]])


def test_a_live_event_has_the_number_and_the_time_of_the_stored_one(service):
    with subscribe(service) as socket:
        next(messages(socket, "clock"))  # it listens from now on
        service.agent.publish(AgentEvent(time_ns=5, kind="alarm", text="temperature 61 degC over 60 degC"))
        live = next(messages(socket, "event"))
    (stored,) = service.get("/events")["items"]
    assert live == {**{name: stored[name] for name in ("id", "run", "bench", "at", "kind", "text")}, "time_ns": 5}


def test_an_event_that_cannot_be_stored_arrives_without_a_number(service, monkeypatch):
    def fail(*given):
        raise CatalogueUnavailableError("database or disk is full")

    journal = service.client.app.state.context.catalogue.event_journal
    monkeypatch.setattr(journal, "record", fail)
    with subscribe(service) as socket:
        next(messages(socket, "clock"))
        service.agent.publish(AgentEvent(time_ns=5, kind="trip", text="force 1 900 N"))
        live = next(messages(socket, "event"))
    assert (live["id"], live["kind"], live["text"]) == (None, "trip", "force 1 900 N")


def test_a_late_client_gets_the_latest_batch_with_its_age(service):
    with subscribe(service) as socket:
        service.agent.publish(batch(1, 2.0))
        next(batches(socket))
    with subscribe(service) as socket:
        announced = next(messages(socket, "channels"))
        assert announced["channels"] == [{"name": "force", "unit": "N"}]
        assert announced["age_s"] == pytest.approx(time.time() - 100.0, abs=60.0)


def test_a_client_gets_decimated_samples_on_request(service):
    with subscribe(service, rate_hz=100.0) as socket:
        service.agent.publish(batch(1, *range(40)))
        found = next(batches(socket))
        assert (found.values[0, 0], found.values[0, -1]) == (0.0, 39.0)
        assert 1 / found.period_s == pytest.approx(100.0)


def test_a_client_that_acknowledges_nothing_loses_batches_and_is_told_so_when_it_resumes(service):
    with subscribe(service, acknowledge=True) as socket, subscribe(service) as other:
        given, others = batches(socket), batches(other)
        for k in range(60):
            service.agent.publish(batch(k, 1.0))
            assert next(others).sequence == k
        for k in range(MAX_UNACKNOWLEDGED + 1):
            assert next(given).sequence == k
        socket.send_json({"something": "of a newer client"})
        socket.send_json({"received": MAX_UNACKNOWLEDGED})
        assert next(messages(socket, "lost"))["batches"] == 60 - MAX_QUEUED_BATCHES - MAX_UNACKNOWLEDGED - 1
        channels = (Channel("force", "N"),)
        first = next(found["bytes"] for found in iter(socket.receive, None) if found.get("bytes"))
        assert decode_batch(first, channels).sequence == 60 - MAX_QUEUED_BATCHES


def test_changes_of_runs_and_jobs_are_published(service):
    with subscribe(service) as socket:
        run = service.post("/runs", {"method": "quick"}, 201)
        runs = messages(socket, "run")
        assert next(runs)["state"] == "running"
        write_complete_log(service.data / run["log"], run["id"])
        service.agent.finish()
        assert next(runs)["outcome"] == "clean"
        job = next(messages(socket, "job"))
        assert (job["run"], job["state"]) == (run["id"], "queued")
        service.report("on_started", job["id"])
        service.report("on_progress", job["id"], JobProgress("refine", 0.4, "identify: refine"))
        found = next(found for found in messages(socket, "job") if found["activity"])
        assert (found["activity"], found["stage"], found["fraction"]) == ("identify: refine", "refine", 0.4)


def test_a_new_client_gets_the_status_at_once(service):
    service.agent.publish()
    service.wait_for("/bench", lambda found: found["state"] == "idle")
    with subscribe(service) as socket:
        service.agent.publish()
        next(messages(socket, "status"))
    with subscribe(service) as socket:
        assert next(messages(socket, "status"))["state"] == "idle"


def test_a_status_keeps_the_time_at_which_it_was_true_for_a_late_client(service):
    made = time.time() - 33.0
    service.agent.publish(service.agent.status.model_copy(update={"utc_s": made}))
    with subscribe(service) as socket:
        wait_until(lambda: service.client.app.state.context.benches.get(None).live._last_status is not None)
    with subscribe(service) as socket:
        assert next(messages(socket, "status"))["utc_s"] == pytest.approx(made)


def test_a_status_that_waited_in_a_queue_is_not_the_present_one(service):
    monitor = service.client.app.state.context.benches.get(None).monitor
    service.agent.publish()
    wait_until(lambda: monitor.latest_status is not None)
    service.agent.publish(service.agent.status.model_copy(update={"utc_s": time.time() - 3.0}))
    wait_until(lambda: monitor.latest_status is None)
    service.agent.reachable = False
    assert service.client.get("/api/v1/bench").status_code == 503


def test_the_service_sends_its_clock_at_once_and_repeatedly(service):
    with subscribe(service) as socket:
        clock = messages(socket, "clock")
        first, second = next(clock)["utc_s"], next(clock)["utc_s"]
        assert first < second <= time.time()


def test_health_reports_a_missing_worker(service):
    assert service.get("/health")["agent"] == "ok"
    assert service.get("/health")["worker"] == "ok"
    assert service.get("/health")["disk"] == "ok"
    service.client.app.state.context.space_monitor._warning = "the disk of runs has 0.4 GB free"
    assert service.get("/health")["disk"] == "the disk of runs has 0.4 GB free"
    service.engine.state = "no worker; start one: mrbench worker"
    assert service.get("/health")["worker"].startswith("no worker")


def test_health_reports_a_silent_agent(service):
    service.agent.reachable = False
    assert "no rig agent answered" in service.get("/health")["agent"]


def test_an_unusable_message_does_not_end_the_subscription(service, caplog, monkeypatch):
    monkeypatch.setattr("bench.service.agent_monitor._RETRY_TIME", 0.001)
    with subscribe(service) as socket:
        next(messages(socket, "clock"))  # it listens from now on
        service.agent.publish(
            AgentEvent.model_construct(time_ns=object(), kind="alarm", text="of another version")
        )
        service.agent.publish(AgentEvent(time_ns=6, kind="alarm", text="understood"))
        assert next(messages(socket, "event"))["text"] == "understood"
    assert "agent_message_unused" in caplog.text


def test_a_status_that_cannot_be_recorded_is_logged_and_tried_again(service, caplog, monkeypatch):
    registry = service.client.app.state.context.registry
    add_run, failures = registry._add_run, iter([RuntimeError("the catalogue is locked")])

    async def fail_once(*given):
        if (error := next(failures, None)) is not None:
            raise error
        return await add_run(*given)

    monkeypatch.setattr(registry, "_add_run", fail_once)
    service.agent.send(RunCommand(method=load_method("quick").model_dump(mode="json", by_alias=True)))
    service.agent.publish()
    wait_until(lambda: "runs_not_recorded" in caplog.text)
    service.agent.publish()
    service.wait_for("/runs", lambda found: [run["id"] for run in found["items"]] == ["run-1"])


def test_a_failed_scan_is_logged_and_repeated(service, caplog, monkeypatch):
    monkeypatch.setattr("bench.service.run_registry.SCAN_PERIOD", 0.01)
    failures = iter([ValueError("a defect")])
    scan_logs = run_registry.scan_logs

    def fail_once(*given):
        if (error := next(failures, None)) is not None:
            raise error
        return scan_logs(*given)

    monkeypatch.setattr(run_registry, "scan_logs", fail_once)
    service.start()
    wait_until(lambda: "scan_failed" in caplog.text)
    write_complete_log(service.data / "found.mcap", "found")
    service.wait_for("/runs", lambda found: [run["id"] for run in found["items"]] == ["found"])

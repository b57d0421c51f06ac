"""Websocket, and the messages that a slow client misses."""

import asyncio
import time
from contextlib import contextmanager

import orjson
import pytest

from bench.agent_protocol.messages import AgentEvent, RunCommand, Samples
from bench.jobs.progress import JobProgress
from bench.service import run_registry
from bench.service.agent_monitor import join_batches
from bench.service.live import MAX_QUEUED_BATCHES, MAX_QUEUED_EVENTS, SubscriberQueue
from tests.support.service_logs import write_complete_log

LIVE = "ws://127.0.0.1:8600/api/v1/live"


def samples(*time_ns, **values):
    return Samples(time_ns=list(time_ns), values={name: list(column) for name, column in values.items()})


def messages(socket, topic):
    while True:
        message = orjson.loads(socket.receive_text())
        assert set(message) == {"topic", "data"}
        if message["topic"] == topic:
            yield message["data"]


def wait_until(condition):
    deadline = time.monotonic() + 20
    while not condition():
        assert time.monotonic() < deadline, "the condition was not met in time"
        time.sleep(0.001)


@contextmanager
def subscribe(service):
    with service.client.websocket_connect(LIVE) as socket:
        socket.send_json({"token": service.token})
        yield socket


def test_messages_of_the_agent_arrive_on_the_websocket(service):
    with subscribe(service) as socket:
        service.agent.publish()
        assert next(messages(socket, "status"))["state"] == "idle"
        service.agent.publish(AgentEvent(time_ns=5, kind="alarm", text="temperature 61 degC over 60 degC"))
        assert next(messages(socket, "event"))["kind"] == "alarm"
        service.agent.publish(samples(1, 2, force=[3.0, None]))
        found = next(messages(socket, "samples"))
        assert found["time_ns"] == [1, 2]
        assert found["values"] == {"force": [3.0, None]}


def test_samples_arrive_once_and_in_order_in_fewer_batches(service):
    with subscribe(service) as socket:
        for k in range(50):
            service.agent.publish(samples(2 * k, 2 * k + 1, force=[1.0, 2.0]))
        times, batches = [], 0
        for found in messages(socket, "samples"):
            times += found["time_ns"]
            batches += 1
            if times[-1] == 99:
                break
        assert times == sorted(times)
        assert batches < 50


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
    service.wait_for("/agent", lambda found: found["state"] == "idle")
    with subscribe(service) as socket:
        service.agent.publish()
        next(messages(socket, "status"))
    with subscribe(service) as socket:
        assert next(messages(socket, "status"))["state"] == "idle"


def test_a_status_keeps_the_time_at_which_it_was_true_for_a_late_client(service):
    made = time.time() - 33.0
    service.agent.publish(service.agent.status.model_copy(update={"utc_s": made}))
    with subscribe(service) as socket:
        wait_until(lambda: service.client.app.state.context.live._last_status is not None)
    with subscribe(service) as socket:
        assert next(messages(socket, "status"))["utc_s"] == pytest.approx(made)


def test_a_status_that_waited_in_a_queue_is_not_the_present_one(service):
    monitor = service.client.app.state.context.monitor
    service.agent.publish()
    wait_until(lambda: monitor.latest_status is not None)
    service.agent.publish(service.agent.status.model_copy(update={"utc_s": time.time() - 3.0}))
    wait_until(lambda: monitor.latest_status is None)
    service.agent.reachable = False
    assert service.client.get("/api/v1/agent").status_code == 503


def test_the_service_sends_its_clock_at_once_and_repeatedly(service):
    with subscribe(service) as socket:
        clock = messages(socket, "clock")
        first, second = next(clock)["utc_s"], next(clock)["utc_s"]
        assert first < second <= time.time()


def test_joined_batches_have_the_stamp_of_the_newest():
    batches = [samples(k, force=[1.0]).model_copy(update={"utc_s": 100.0 + k}) for k in range(3)]
    assert join_batches(batches).utc_s == 102.0


def test_a_slow_client_gets_a_limited_number_of_the_newest_messages():
    async def slow():
        subscriber = SubscriberQueue()
        for k in range(1000):
            subscriber.put("samples", "", f"samples {k}")
            subscriber.put("event", "", f"event {k}")
            subscriber.put("status", "", f"status {k}")
            subscriber.put("job", f"job {k % 2}", f"job {k}")
        return await subscriber.take()

    found = asyncio.run(slow())
    assert [text for text in found if text.startswith("status")] == ["status 999"]
    assert sorted(text for text in found if text.startswith("job")) == ["job 998", "job 999"]
    assert [text for text in found if text.startswith("samples")] == [
        f"samples {k}" for k in range(1000 - MAX_QUEUED_BATCHES, 1000)
    ]
    assert len([text for text in found if text.startswith("event")]) == MAX_QUEUED_EVENTS


def test_joined_batches_have_null_for_a_missing_field():
    both = join_batches([samples(1, 2, force=[1.0, 2.0]), samples(3, force=[3.0], temperature=[20.0])])
    assert both.time_ns == [1, 2, 3]
    assert both.values == {"force": [1.0, 2.0, 3.0], "temperature": [None, None, 20.0]}


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
        service.agent.publish(
            AgentEvent.model_construct(time_ns=object(), kind="alarm", text="of another version")
        )
        service.agent.publish(AgentEvent(time_ns=6, kind="alarm", text="understood"))
        assert next(messages(socket, "event"))["text"] == "understood"
    assert "agent_message_unused" in caplog.text


def test_a_status_that_cannot_be_recorded_is_logged_and_tried_again(service, caplog, monkeypatch):
    registry = service.client.app.state.context.registry
    add_run, failures = registry._add_run, iter([RuntimeError("the catalogue is locked")])

    async def fail_once(run):
        if (error := next(failures, None)) is not None:
            raise error
        return await add_run(run)

    monkeypatch.setattr(registry, "_add_run", fail_once)
    service.agent.send(RunCommand(method={"name": "quick"}))
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

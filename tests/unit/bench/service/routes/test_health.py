"""Health in words, and metrics for Prometheus."""

import pytest
from prometheus_client.parser import text_string_to_metric_families

from bench.agent_protocol import AgentStatus, InstrumentStatus
from bench.catalogue.job_queue import JobQueue
from bench.service.routes.health import describe_clocks
from tests.support.service_logs import write_complete_log

API = "/api/v1"


def make_instrument(name, error_bound):
    return InstrumentStatus(
        name=name,
        driver="modbus",
        address="tcp://127.0.0.1:502",
        connected=True,
        received=12,
        lost=3,
        corrupted=1,
        resynchronised=0,
        age_s=None,
        clock_error_bound_s=error_bound,
        message="",
    )


def read_metrics(service):
    answer = service.client.get(f"{API}/metrics")
    assert answer.headers["Content-Type"].startswith("text/plain")
    families = text_string_to_metric_families(answer.text)
    return {(one.name, *one.labels.values()): one.value for family in families for one in family.samples}


def test_all_parts_have_words(service):
    health = service.get("/health")
    assert (health["agent"], health["worker"], health["disk"], health["queue"]) == ("ok", "ok", "ok", "empty")
    assert health["clocks"] in ("ok", "not known without a rig agent")


def test_waiting_jobs_are_counted(service):
    write_complete_log(service.data / "one.mcap")
    service.scan()
    service.wait_for("/health", lambda health: health["queue"] == "0 running, 1 waiting")


def test_the_catalogue_is_read_again_only_after_a_change(service, monkeypatch):
    made, original = [], JobQueue.count_states
    monkeypatch.setattr(JobQueue, "count_states", lambda queue: made.append(1) or original(queue))
    assert [service.get("/health")["queue"] for _ in range(5)] == ["empty"] * 5
    assert len(made) < 5
    write_complete_log(service.data / "one.mcap")
    service.scan()
    service.wait_for("/health", lambda health: health["queue"] == "0 running, 1 waiting")


def test_the_log_store_has_words_and_numbers(service, tmp_path):
    assert service.get("/health")["log_store"] == "not used"
    write_complete_log(service.data / "one.mcap")
    service.scan()
    service.start(log_store=f"file://{tmp_path}/store")
    service.wait_for("/health", lambda health: "bucket or folder of the log store" in health["log_store"])
    metrics = read_metrics(service)
    assert (metrics["mrbench_log_store_up",], metrics["mrbench_logs_waiting",]) == (0, 1)
    (tmp_path / "store").mkdir()
    service.start(log_store=f"file://{tmp_path}/store")
    copied = service.wait_for("/runs/run-1/integrity", lambda integrity: integrity["copied"] is not None)
    assert copied["copy_url"].startswith(f"file://{tmp_path}/store/one.")
    service.wait_for("/health", lambda health: health["log_store"] == "ok")
    metrics = read_metrics(service)
    assert metrics["mrbench_log_store_up",] == metrics["mrbench_logs_copied_total",] == 1
    assert metrics["mrbench_logs_waiting",] == metrics["mrbench_log_copies_failed_total",] == 0


@pytest.mark.parametrize(
    ("bound", "words"),
    [(None, "ok"), (0.001, "ok"), (0.0034, "lvdt within 3.4 ms only")],
)
def test_a_clock_that_is_not_known_well_is_named(bound, words):
    assert describe_clocks(AgentStatus(state="idle", instruments=(make_instrument("lvdt", bound),))) == words


def test_without_an_agent_the_clocks_are_not_known():
    assert describe_clocks(None) == "not known without a rig agent"


def test_metrics_tell_the_state_of_bench_instruments_and_jobs(service):
    status = service.agent.status.model_copy(update={"instruments": (make_instrument("lvdt", 0.0004),)})
    service.agent.status = status
    service.agent.publish()
    write_complete_log(service.data / "one.mcap")
    service.scan()
    service.wait_for("/bench", lambda found: found["instruments"])
    service.wait_for("/jobs", lambda found: found["items"])
    metrics = read_metrics(service)
    assert metrics["mrbench_agent_up",] == metrics["mrbench_worker_up",] == 1
    assert metrics["mrbench_bench_state", "idle"] == 1
    assert metrics["mrbench_samples_lost_total", "lvdt"] == 3
    assert metrics["mrbench_clock_error_bound_seconds", "lvdt"] == 0.0004
    assert ("mrbench_instrument_age_seconds", "lvdt") not in metrics
    assert metrics["mrbench_jobs", "queued"] == metrics["mrbench_runs", "ended"] == 1
    assert metrics["mrbench_disk_free_bytes",] > 0


def test_requests_are_counted_by_the_operation_that_answers(service):
    assert service.client.get(f"{API}/runs/none").status_code == 404
    metrics = read_metrics(service)
    key = ("mrbench_request_duration_seconds_count", "GET", "get_run", "404")
    assert metrics[key] == 1


def test_metrics_of_an_absent_agent_and_worker(service):
    service.agent.reachable, service.engine.state = False, "no worker"
    service.agent.forget()
    metrics = read_metrics(service)
    assert metrics["mrbench_worker_up",] == 0
    assert {name for name, *_ in metrics} >= {"mrbench_agent_up", "mrbench_live_listeners"}


def test_metrics_need_the_token(service):
    assert service.client.get(f"{API}/metrics", headers={"Authorization": ""}).status_code == 401

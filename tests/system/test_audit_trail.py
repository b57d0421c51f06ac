"""Audit trail of a whole bench: local commands while the service is down, and kills of both processes."""

import subprocess

import pytest

from bench.audit import compare_imports, find_agent_trail, verify_chain
from tests.support.bench_processes import ENVIRONMENT, MRBENCH, BenchProcesses, wait_for

pytestmark = [pytest.mark.wire, pytest.mark.timeout(300)]


@pytest.fixture
def bench(tmp_path):
    bench = BenchProcesses(tmp_path)
    try:
        bench.start_rig()
        bench.start_service()
        yield bench
    finally:
        bench.end()


def call(bench, *words):
    command = [*MRBENCH, *words]
    return subprocess.run(
        command, cwd=bench.folder, env=ENVIRONMENT, capture_output=True, text=True, timeout=120, check=False
    )


def find_acts(bench, action):
    """Return the acts of the rig agent with an action, once the service has imported one."""
    page = bench.get(f"/audit?action={action}&limit=500")
    return [one for one in page["items"] if one["source"] is not None] if page else []


def test_a_stop_while_the_service_is_down_is_found_after_its_start_and_both_trails_are_verified(bench):
    assert bench.post("/bench/abort")["state"] == "tripped"
    aborted = wait_for(lambda: find_acts(bench, "abort"), lambda: bench.read("service"))[0]
    requests = bench.get("/audit?action=POST%20/bench/abort")["items"]
    assert (aborted["request"], aborted["actor"]) == (requests[0]["request"], "bench")
    assert aborted["peer"].startswith("account ")
    bench.kill("service")
    stopped = call(bench, "stop", "--config", "bench.toml")
    assert stopped.returncode == 0, stopped.stderr
    bench.start_service()
    act = wait_for(lambda: find_acts(bench, "stop"), lambda: bench.read("service"))[0]
    assert act["actor"].startswith("local:")
    assert act["outcome"] == "ok"
    for name in ("agent", "service"):
        bench.kill(name)
    bench.start_service()
    wait_for(lambda: len(find_acts(bench, "agent%20start")) == 2, lambda: bench.read("service"))
    assert len(find_acts(bench, "stop")) == 1
    assert bench.get("/health")["audit"] == "ok"
    verified = call(bench, "audit", "verify", "--data", "runs", "--config", "bench.toml")
    assert verified.returncode == 0, verified.stderr
    result = verify_chain(bench.data / "audit.jsonl")
    assert compare_imports(result, find_agent_trail(bench.toml)) == ""
    path = bench.data / "audit.jsonl"
    path.write_bytes(path.read_bytes().replace(b"/bench/abort", b"/bench/other", 1))
    altered = call(bench, "audit", "verify", "--data", "runs")
    assert altered.returncode == 1
    assert "the audit trail was altered: line " in altered.stderr

"""Jobs with one and with more workers: real jobs, and jobs that only wait.

python -m benchmarks workers                           real jobs with 1 and 2 workers, waiting ones with 2 to 16
python -m benchmarks.speed.workers wait DATA           a worker whose jobs only wait, a process of its own

Scheduler, service and workers are separate processes on this machine, and no bench is connected. Waiting jobs need
no processor, so their rate shows what the queue costs: scheduler, service and catalogue.
"""

import math
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import httpx2
import numpy as np

import bench.jobs.dask_task
from bench.jobs import find_scheduler, get_tls_file, locate_scheduler, run_worker
from bench.jobs.job_spec import JobSpec, ResultSummary
from bench.jobs.work import JobCallbacks
from bench.log import Identity, LogWriter, RunHeader
from bench.methods import load_method
from bench.processes import MRBENCH_COMMAND, terminate
from bench.runs import run_from_plant
from benchmarks.common import print_line
from benchmarks.speed.overlay import get, serve, wait_for

REAL_WORKERS, REAL_LOGS = (1, 2), 4
"""Numbers of workers, and logs of the method, of real jobs."""
WAITING_WORKERS, WAITING_LOGS = (2, 4, 8, 16), 8
"""Numbers of workers, and short logs for each worker, of jobs that only wait."""
WAIT = 2.0
"""Duration of a waiting job [s]; a real one takes longer."""
REQUIRED = 0.85
METHOD = "quick"
_SUMMARY: ResultSummary = {
    "verdict": "no_gap", "effects": [], "probability": 1.0, "before_n": 1.0, "after_n": 1.0, "noise_floor_n": 1.0,
    "shrinkage": None, "shrinkage_ci95": None, "explanation": "",
}  # fmt: skip
"""Answer of a waiting job."""
_STARTED = datetime(2026, 1, 1, tzinfo=UTC)


def run() -> None:
    """Print how the rate of jobs grows with the number of workers."""
    with TemporaryDirectory() as folder:
        real = {
            n: _run_jobs(Path(folder) / f"real{n}", n, REAL_LOGS, ["worker", "--nice", "0"]) for n in REAL_WORKERS
        }
        durations = {n: _measure_duration(jobs, n) for n, jobs in real.items()}
        print(f"workers: {2 * REAL_LOGS} real jobs, identification and diagnosis of {METHOD}")
        for count, duration in durations.items():
            print(f"  with {count}: {duration:.1f} s")
        print_line("  share of linear, 2 workers", durations[1] / (2.0 * durations[2]), "", f">= {REQUIRED}")
        print(f"workers: jobs that wait {WAIT:g} s")
        for count in WAITING_WORKERS:
            jobs = _run_jobs(Path(folder) / f"wait{count}", count, WAITING_LOGS * count, None)
            share = _measure_rate(jobs, count) * WAIT / count
            print_line(f"  share of linear, {count} workers, {len(jobs)} jobs", share, "", f">= {REQUIRED}")


def _run_jobs(data: Path, count: int, logs: int, command: Sequence[str] | None) -> list[dict[str, Any]]:
    """Execute both jobs of each log with a number of workers; return all jobs.

    Args:
        data: new data folder.
        count: number of workers.
        logs: number of logs.
        command: words of mrbench that start a worker; None for workers whose jobs only wait.
    """
    data.mkdir()
    for number in range(logs):
        if command:
            _record_log(data / f"run{number:03d}.mcap", number)
        else:
            _write_log(data, number)
    with ExitStack() as stack:
        stack.enter_context(_start([*MRBENCH_COMMAND, "scheduler", "--data", str(data), "--port", "0"]))
        address = wait_for(lambda: _find_scheduler(data))
        client = stack.enter_context(serve(data, "--scheduler", address))
        wait_for(lambda: len(_list_jobs(client)) == logs)
        words = [sys.executable, "-m", "benchmarks.speed.workers", "wait", str(data)]
        if command:
            words = [*MRBENCH_COMMAND, *command, "--data", str(data)]
        for _ in range(count):
            stack.enter_context(_start(words))
        jobs: list[dict[str, Any]] = wait_for(lambda: _list_ended(client, 2 * logs))
        return jobs


def _find_scheduler(data: Path) -> str:
    return find_scheduler(data) if (data / "scheduler.address").is_file() else ""


def _list_jobs(client: httpx2.Client) -> list[dict[str, Any]]:
    """Return all jobs, page by page."""
    found: list[dict[str, Any]] = []
    query = "jobs?limit=100"
    while True:
        page = get(client, query)
        found += page["items"]
        if not page.get("next"):
            return found
        query = f"jobs?limit=100&before={page['next']}"


def _list_ended(client: httpx2.Client, count: int) -> list[dict[str, Any]]:
    """Return the jobs if so many have ended; empty before.

    Raises:
        RuntimeError: a job failed.
    """
    time.sleep(1.0)  # each question costs the service time that the jobs need
    jobs = _list_jobs(client)
    failed = next((one for one in jobs if one["state"] == "failed"), None)
    if failed:
        raise RuntimeError(f"job {failed['id']} failed: {failed['error']}")
    return jobs if sum(one["state"] == "done" for one in jobs) == count else []


def _measure_duration(jobs: Sequence[Mapping[str, Any]], count: int) -> float:
    """Return the time [s] from the moment when all workers were busy to the end of the last job."""
    ends = [_parse(one["finished"]) for one in jobs]
    return max(ends) - _find_busy_time(jobs, count)


def _measure_rate(jobs: Sequence[Mapping[str, Any]], count: int) -> float:
    """Return the rate [1/s] at which jobs end while all workers are busy and further jobs wait."""
    begin, end = _find_busy_time(jobs, count), max(_parse(one["started"]) for one in jobs)
    return sum(begin < _parse(one["finished"]) <= end for one in jobs) / (end - begin)


def _find_busy_time(jobs: Sequence[Mapping[str, Any]], count: int) -> float:
    """Return the first time [s] at which so many jobs were executed."""
    changes = sorted(
        [(_parse(one["started"]), 1) for one in jobs] + [(_parse(one["finished"]), -1) for one in jobs]
    )
    busy = 0
    for moment, change in changes:
        busy += change
        if busy == count:
            return moment
    return math.nan


def _parse(moment: str) -> float:
    return datetime.fromisoformat(moment).timestamp()


def _record_log(log: Path, number: int) -> None:
    """Record a run on the simulated rig; each has its own noise."""
    identity = Identity("", "", _STARTED + timedelta(minutes=number))
    run_from_plant(load_method(METHOD), "default", log, identity, seed=number + 1)


def _write_log(data: Path, number: int) -> None:
    """Write a run of two seconds, which no job reads."""
    name, started = f"run{number:03d}", _STARTED + timedelta(minutes=number)
    header = RunHeader(
        id=name, specimen="none", method="none", drive_kind="coil_v", drive_unit="V", source="run", operator="",
        utc_offset=started.isoformat(),
    )  # fmt: skip
    seconds = np.arange(1000) / 500.0
    columns = {name: np.sin(seconds + number) for name in ("displacement", "velocity", "force", "coil_drive")}
    with LogWriter(data / f"{name}.mcap", header) as log:
        log.write_samples(np.round(1e9 * seconds).astype(np.int64), columns)
        log.close("clean", "")


@contextmanager
def _start(command: Sequence[str]) -> Iterator[None]:
    """Run a process meanwhile."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield
    finally:
        terminate(process, 30.0)


def run_waiting_worker(data: Path) -> None:
    """Run a worker of the service on a data folder whose jobs only wait."""
    setattr(bench.jobs.dask_task, "execute_job", _wait)  # noqa: B010 - not an export of that module
    run_worker(locate_scheduler(find_scheduler(data), get_tls_file(data)), 0)


def _wait(spec: JobSpec, callbacks: JobCallbacks) -> ResultSummary:
    time.sleep(WAIT)
    return dict(_SUMMARY)


if __name__ == "__main__":
    run_waiting_worker(Path(sys.argv[2]))

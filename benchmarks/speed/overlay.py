"""Time of a comparison of ten runs of two minutes by REST, next to reading the same samples with numpy.

python -m benchmarks overlay

The first request reads the logs, which are stored as columns then; later requests read the columns. The first run
is the reference, with the band of its fit. All other jobs are cancelled, so that nothing else is computed.
``python -m benchmarks.speed.overlay --keep FOLDER`` keeps the logs for a later call.
"""

import argparse
import os
import re
import shutil
import statistics
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import httpx2

from bench.log import Identity
from bench.processes import MRBENCH_COMMAND, terminate
from bench.runs import run_from_plant
from bench.samples import SampleStore
from benchmarks.common import lengthen_method, open_folder, print_line

RUNS = 10
LENGTHENING = 6
"""Factor on the cycles of `quick` [1], which give about two minutes with its rests."""
REQUIREMENT_S = 1.0
"""Longest time of the comparison [s]."""
_REPEATS = 9
_FIT_TIMEOUT = 600.0
_POLL_PERIOD = 0.5
_FIRST = datetime(2026, 1, 1, tzinfo=UTC)
_ADDRESS = re.compile(r"http://[\d.:]+")


def run() -> None:
    """Print the time of the first and of later comparisons, and that of reading the samples alone."""
    with TemporaryDirectory() as folder:
        measure_overlay(Path(folder))


def main() -> None:
    """Print the same, with logs that may be kept."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", type=Path, help="folder for the logs")
    with open_folder(parser.parse_args().keep) as kept:
        measure_overlay(kept)


def measure_overlay(kept: Path) -> None:
    """Print the times for the logs of a folder; those that are missing are recorded first."""
    recorded = [record_run(kept, number) for number in range(RUNS)]
    with TemporaryDirectory() as folder:
        data = Path(folder)
        logs = [Path(shutil.copy(log, data)) for log in recorded]
        with serve(data) as client:
            rows = wait_for_runs(client)
            cancel_jobs(client, rows)
            fit(client, rows[0])
            query = "&".join(f"run={one['id']}" for one in rows) + f"&reference={rows[0]['id']}"
            first, found = time_once(lambda: get(client, f"comparisons?{query}"))
            later = measure(lambda: get(client, f"comparisons?{query}"))
        hashes = {Path(one["log"]).name: one["log_sha256"] for one in rows}
        store = SampleStore(data)
        base = measure(lambda: [store.load(log, hashes[log.name]) for log in logs])
    print_results(found, first, later, base)


def print_results(found: dict[str, Any], first: float, later: float, base: float) -> None:
    """Print the times and their ratios to the baseline."""
    uncertainty = found["strokes"][0]["band"]["model_uncertainty_n"]
    curves = sum(len(stroke["strokes"]) for stroke in found["strokes"])
    print(
        f"comparison: {RUNS} runs of two minutes at 1 kHz, {curves} mean cycles, model uncertainty {uncertainty} N"
    )
    print_line("baseline: stored samples of all runs read with numpy", 1e3 * base, "ms", "")
    limit = f"at most {1e3 * REQUIREMENT_S:g}"
    print_line("first comparison by REST, samples read from the logs", 1e3 * first, "ms", "")
    print_line("  over the baseline", first / base, "", "")
    print_line("later comparison by REST, samples stored as columns", 1e3 * later, "ms", limit)
    print_line("  over the baseline", later / base, "", "")


def record_run(data: Path, number: int) -> Path:
    """Record two minutes on the default simulated rig, unless the log exists."""
    log = data / f"{number}.mcap"
    if log.exists():
        return log
    identity = Identity("MR-0042", "", _FIRST + timedelta(hours=number))
    run_from_plant(lengthen_method("quick", LENGTHENING), "default", log, identity, seed=number)
    return log


@contextmanager
def serve(data: Path, *options: str) -> Iterator[httpx2.Client]:
    """Start a service on a data folder, by default without a rig, and yield a client with its token."""
    command = [*MRBENCH_COMMAND, "serve", "--data", str(data), "--port", "0", *options]
    environment = os.environ | {"PYTHONUNBUFFERED": "1"}
    with (data / "service.log").open("w") as output:
        process = subprocess.Popen(command, stdout=output, stderr=output, env=environment)
    try:
        address = wait_for(lambda: _ADDRESS.search((data / "service.log").read_text("utf-8")))[0]
        headers = {"Authorization": f"Bearer {(data / 'token').read_text('ascii').strip()}"}
        with httpx2.Client(base_url=f"{address}/api/v1/", headers=headers, timeout=120.0) as client:
            yield client
    finally:
        terminate(process, 30.0)


def wait_for_runs(client: httpx2.Client) -> list[dict[str, Any]]:
    """Wait until all logs are catalogued; return the runs, the oldest first."""
    rows: list[dict[str, Any]] = wait_for(lambda: list_runs(client))
    return sorted(rows, key=lambda one: str(one["started"]))


def list_runs(client: httpx2.Client) -> list[dict[str, Any]] | None:
    """Return the runs if all are complete."""
    rows: list[dict[str, Any]] = get(client, "runs?limit=50")["items"]
    return rows if len(rows) == RUNS and all(one["log_sha256"] and one["jobs"] for one in rows) else None


def cancel_jobs(client: httpx2.Client, rows: list[dict[str, Any]]) -> None:
    """Cancel all unfinished jobs of runs."""
    for row in rows:
        for job in row["jobs"]:
            if job["state"] in ("queued", "running"):
                client.post(f"jobs/{job['id']}/cancel").raise_for_status()


def fit(client: httpx2.Client, row: dict[str, Any]) -> None:
    """Fit the law to a run without the network, and cancel the diagnosis that follows."""
    path = f"runs/{row['id']}"
    job = client.post(f"{path}/identify", json={"stages": ["refine"]}).raise_for_status().json()
    wait_for(lambda: get(client, f"jobs/{job['id']}")["state"] == "done")
    wait_for(lambda: any(one["kind"] == "diagnose" for one in get(client, path)["jobs"]))
    cancel_jobs(client, [get(client, path)])


def get(client: httpx2.Client, path: str) -> Any:
    """Return the answer at a path."""
    return client.get(path).raise_for_status().json()


def wait_for(find: Callable[[], Any]) -> Any:
    """Return what a function finds, as soon as it finds something."""
    deadline = time.monotonic() + _FIT_TIMEOUT
    while not (found := find()):
        if time.monotonic() > deadline:
            raise TimeoutError(f"no answer as expected within {_FIT_TIMEOUT:g} s; see the output of the service")
        time.sleep(_POLL_PERIOD)
    return found


def time_once(action: Callable[[], Any]) -> tuple[float, Any]:
    """Return the time of an action [s], and its result."""
    began = time.perf_counter()
    result = action()
    return time.perf_counter() - began, result


def measure(action: Callable[[], Any]) -> float:
    """Return the median time of an action [s]."""
    return statistics.median(time_once(action)[0] for _ in range(_REPEATS))


if __name__ == "__main__":
    main()

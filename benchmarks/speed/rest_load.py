"""Latency of the REST interface while a run is recorded at 1 kHz, next to an empty route of the same framework.

python -m benchmarks rest_load

Twenty clients send ten requests a second each, at fixed times. A latency counts from the time at which its request
was due, so that a slow answer also delays the later ones in the result.
"""

import asyncio
import itertools
import json
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import httpx2
import numpy as np

from bench.client import Bench
from bench.demo import DemoFolder, start_processes
from bench.log import read_log
from benchmarks.common import print_line

CLIENTS, RATE, SECONDS = 20, 200.0, 15.0
"""Number of clients, requests of all clients [1/s], duration [s]."""
ROUTES = ("/bench", "/runs?limit=50", "/jobs", "/bench/limits", "/methods", "/events?limit=50", "/health")
METHOD = "quick"
_EMPTY = """
import uvicorn, fastapi
app = fastapi.FastAPI()
@app.get("/empty")
async def empty() -> dict[str, str]:
    return {}
uvicorn.run(app, host="127.0.0.1", port=0, access_log=False)
"""


def run() -> None:
    """Print latencies of an empty route and of the service during a run, and the lost samples of the run."""
    print(f"REST: {CLIENTS} clients, {RATE:g} requests/s for {SECONDS:g} s, a run at 1 kHz in progress")
    with start_empty_server() as address:
        _print_latencies("empty route of FastAPI", asyncio.run(measure_load(address, ("/empty",), {})), "")
    with TemporaryDirectory() as path, start_processes(DemoFolder(Path(path), METHOD, None, 1)) as address:
        base, token = address.split("#token=")
        recorded = Bench(address).start(METHOD, specimen="load")
        headers = {"Authorization": f"Bearer {token}"}
        latencies = asyncio.run(measure_load(f"{base}api/v1", ROUTES, headers))
        _print_latencies("mrbench, " + " ".join(route.split("?")[0] for route in ROUTES), latencies, "at most 50")
        recorded.wait()
        log = read_log(recorded.download_log(Path(path) / "load.mcap"))
    lost = json.loads(log.metadata["outcome"]["lost"])
    print(f"  run: {len(log.samples['time'])} samples, outcome {log.outcome}, lost: {lost or 'nothing'}")


@contextmanager
def start_empty_server() -> Iterator[str]:
    """Run an application with one empty route and yield its address."""
    process = subprocess.Popen([sys.executable, "-c", _EMPTY], stderr=subprocess.PIPE, text=True)
    try:
        lines = iter(process.stderr or ())
        yield next(found[0] for line in lines if (found := re.search(r"http://[\d.:]+", line)))
    finally:
        process.terminate()
        process.wait()


async def measure_load(address: str, routes: tuple[str, ...], headers: dict[str, str]) -> np.ndarray:
    """Return the latency of each request [s]; a refused one ends the benchmark."""
    async with asyncio.TaskGroup() as group:
        tasks = [
            group.create_task(_request_periodically(address, routes, headers, number)) for number in range(CLIENTS)
        ]
    return np.concatenate([task.result() for task in tasks])


async def _request_periodically(
    address: str, routes: tuple[str, ...], headers: dict[str, str], number: int
) -> np.ndarray:
    period, count = CLIENTS / RATE, round(SECONDS * RATE / CLIENTS)
    begin = time.perf_counter() + number / RATE
    latencies = []
    async with httpx2.AsyncClient(headers=headers, timeout=30.0) as client:
        for turn, route in zip(range(count), itertools.cycle(routes), strict=False):
            due = begin + turn * period
            await asyncio.sleep(max(0.0, due - time.perf_counter()))
            (await client.get(address + route)).raise_for_status()
            latencies.append(time.perf_counter() - due)
    return np.array(latencies)


def _print_latencies(name: str, latencies: np.ndarray, requirement: str) -> None:
    print(f"  {name}: {len(latencies)} requests")
    for share, wanted in ((50, ""), (99, requirement)):
        print_line(f"  percentile {share}", 1e3 * float(np.percentile(latencies, share)), "ms", wanted)

"""Latency of the REST interface while a run is recorded at 1 kHz, next to an empty route of the same framework.

python -m benchmarks rest_load

Twenty clients send ten requests a second each, at fixed times, by connections that are open already. A latency
counts from the time at which its request was due, so that a slow answer also delays the later ones in the result.
The empty route is measured twice: on the idle machine, and beside a run. So is the service: without a rig, with
runs and results of a catalogue and after a first answer of each route, and during a run. The simulated rig needs
more than one core of the same machine.
"""

import asyncio
import itertools
import json
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import SplitResult, urlsplit

import httpx2
import numpy as np

from bench.catalogue import CATALOGUE_FILE, make_sqlite_url, open_database
from bench.client import Bench
from bench.demo import DemoFolder, start_processes
from bench.log import read_log
from benchmarks.common import print_line
from benchmarks.speed.catalogue import fill_catalogue
from benchmarks.speed.overlay import get, serve, wait_for

CLIENTS, RATE, SECONDS = 20, 200.0, 15.0
"""Number of clients, requests of all clients [1/s], duration [s]."""
ROUTES = ("/bench", "/runs?limit=50", "/jobs", "/bench/limits", "/methods", "/events?limit=50", "/health")
METHOD = "quick"
RUNS = 60
"""Number of runs in the catalogue of the service without a rig."""
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
    print(f"REST: {CLIENTS} clients, {RATE:g} requests/s for {SECONDS:g} s")
    with start_empty_server() as empty, TemporaryDirectory() as path:
        _print_load("empty route of FastAPI, idle machine", empty, ("/empty",), {})
        _measure_without_rig(Path(path) / "idle")
        with start_processes(DemoFolder(Path(path), METHOD, None, 1)) as address:
            base, token = address.split("#token=")
            headers = {"Authorization": f"Bearer {token}"}
            with httpx2.Client(base_url=f"{base}api/v1/", headers=headers) as client:
                wait_until_ready(client, ROUTES)
            with _record_run(Bench(address), Path(path)):
                _print_load("empty route of FastAPI, beside a run at 1 kHz", empty, ("/empty",), {})
            with _record_run(Bench(address), Path(path)):
                _print_load(
                    f"mrbench during a run, {_name(ROUTES)}", f"{base}api/v1", ROUTES, headers, "at most 50"
                )


def _measure_without_rig(data: Path) -> None:
    """Print the latencies of a service on a catalogue of runs with their results, and without a rig."""
    data.mkdir()
    engine = open_database(make_sqlite_url(data / CATALOGUE_FILE))
    fill_catalogue(engine, RUNS)
    engine.dispose()
    with serve(data) as client:
        headers = {"Authorization": client.headers["Authorization"]}
        routes = tuple(route for route in ROUTES if not route.startswith("/bench"))
        wait_until_ready(client, routes)
        name = f"mrbench, {RUNS} runs, idle machine, {_name(routes)}"
        _print_load(name, str(client.base_url).rstrip("/"), routes, headers, "at most 50")


def wait_until_ready(client: httpx2.Client, routes: tuple[str, ...]) -> None:
    """Wait for the worker, whose start needs a whole core for some seconds, and for an answer of each route."""
    wait_for(lambda: get(client, "health")["worker"] == "ok")
    for route in routes:
        get(client, route.lstrip("/"))


@contextmanager
def _record_run(bench: Bench, folder: Path) -> Iterator[None]:
    """Record a run, and print what it has lost after its end."""
    recorded = bench.start(METHOD, specimen="load")
    yield
    recorded.wait()
    log = read_log(recorded.download_log(folder / f"{recorded.id}.mcap"))
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


async def measure_load(
    address: str,
    routes: tuple[str, ...],
    headers: dict[str, str],
    clients: int = CLIENTS,
    rate: float = RATE,
    seconds: float = SECONDS,
) -> np.ndarray:
    """Return the latency of each request [s]; a refused one ends the benchmark.

    Args:
        address: start of all paths.
        routes: paths, in turn.
        headers: headers of each request.
        clients: number of clients.
        rate: requests of all clients [1/s].
        seconds: duration [s].
    """
    barrier = asyncio.Barrier(clients)
    period, count = clients / rate, round(seconds * rate / clients)
    async with asyncio.TaskGroup() as group:
        tasks = [
            group.create_task(
                _request_periodically(address, routes, headers, count, period, number / rate, barrier)
            )
            for number in range(clients)
        ]
    return np.concatenate([task.result() for task in tasks])


async def _request_periodically(
    address: str,
    routes: tuple[str, ...],
    headers: dict[str, str],
    count: int,
    period: float,
    offset: float,
    barrier: asyncio.Barrier,
) -> np.ndarray:
    parts = urlsplit(address)
    # A client library would need more processor time for a request than the server, on the same machine.
    reader, writer = await asyncio.open_connection(parts.hostname, parts.port)
    latencies = []
    with closing(writer):
        await barrier.wait()
        begin = time.perf_counter() + offset
        for turn, route in zip(range(count), itertools.cycle(routes), strict=False):
            due = begin + turn * period
            await asyncio.sleep(max(0.0, due - time.perf_counter()))
            writer.write(_make_request(parts, route, headers))
            await _read_answer(reader, route)
            latencies.append(time.perf_counter() - due)
    return np.array(latencies)


def _make_request(parts: SplitResult, route: str, headers: dict[str, str]) -> bytes:
    lines = [f"GET {parts.path}{route} HTTP/1.1", f"Host: {parts.netloc}"]
    return "\r\n".join([*lines, *(f"{name}: {value}" for name, value in headers.items()), "", ""]).encode()


async def _read_answer(reader: asyncio.StreamReader, route: str) -> None:
    head = await reader.readuntil(b"\r\n\r\n")
    size = re.search(rb"content-length: (\d+)", head, re.IGNORECASE)
    if not head.startswith(b"HTTP/1.1 200") or size is None:
        raise RuntimeError(f"{route}: {head.decode()}")
    await reader.readexactly(int(size[1]))


def _name(routes: tuple[str, ...]) -> str:
    return " ".join(route.split("?")[0] for route in routes)


def _print_load(
    name: str, address: str, routes: tuple[str, ...], headers: dict[str, str], requirement: str = ""
) -> None:
    latencies = asyncio.run(measure_load(address, routes, headers))
    print(f"  {name}: {len(latencies)} requests")
    for share, wanted in ((50, ""), (99, requirement)):
        print_line(f"  percentile {share}", 1e3 * float(np.percentile(latencies, share)), "ms", wanted)

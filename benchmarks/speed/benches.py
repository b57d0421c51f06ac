"""One service with one and with ten benches: samples at a listener of each bench, latency of the REST interface.

python -m benchmarks benches                                   one bench, then ten
python -m benchmarks.speed.benches listen URL SECONDS NAME...  the listeners, a process of their own

Scripted agents publish 100 samples a second each over the real sockets. A listener of each bench counts the
samples whose number is missing. Meanwhile clients send requests at fixed times, as in
`benchmarks.speed.rest_load`.
"""

import asyncio
import json
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import httpx2
import numpy as np
import psutil

from bench.catalogue import CATALOGUE_FILE, make_sqlite_url, open_database
from bench.client import Bench
from benchmarks.common import print_line
from benchmarks.speed.catalogue import fill_catalogue
from benchmarks.speed.overlay import get, serve, wait_for
from benchmarks.speed.rest_load import measure_load, wait_until_ready
from benchmarks.speed.scripted_agents import play_agents

COUNTS, RATE = (1, 10), 100
"""Numbers of benches, samples of each bench [1/s]."""
SECONDS, REQUESTS, CLIENTS = 30.0, 50.0, 10
"""Duration [s], requests of all clients [1/s], number of clients."""
ROUTES = (
    "/benches/b0",
    "/runs?limit=50",
    "/jobs",
    "/benches/b0/limits",
    "/methods",
    "/events?limit=50",
    "/benches",
)
RUNS = 60
"""Number of runs in the catalogue."""
_END = 3.0
"""Time for which the listeners outlast the requests [s]."""


def run() -> None:
    """Print lost samples, latencies and processor time with one and with ten benches."""
    print(f"benches: {RATE:g} samples/s each, a listener each, {REQUESTS:g} requests/s for {SECONDS:g} s")
    found = {count: _measure(count) for count in COUNTS}
    few, many = (found[count] for count in COUNTS)
    for name in few:
        if few[name]:
            print_line(f"  {name}: ten over one", many[name] / few[name], "", "as with one")


def _measure(count: int) -> dict[str, float]:
    """Print and return the figures of a service with a number of benches."""
    names = [f"b{number}" for number in range(count)]
    with TemporaryDirectory() as path:
        data = _make_catalogue(Path(path) / "runs")
        with serve_benches(Path(path), data, count, RATE) as client:
            wait_until_ready(client, ROUTES)
            token = client.headers["Authorization"].removeprefix("Bearer ")
            address = str(client.base_url).rstrip("/")
            return _load(address, token, names)


@contextmanager
def serve_benches(folder: Path, data: Path, count: int, rate: int) -> Iterator[httpx2.Client]:
    """Play agents b0, b1, ... in a folder, serve their benches, and yield a client once all are idle."""
    options = [f"--bench=b{number}=ipc://{folder}/b{number}" for number in range(count)]
    with play_agents(folder, count, rate), serve(data, *options) as client:
        wait_for(lambda: all(one["state"] == "idle" for one in get(client, "benches")["items"]))
        yield client


def _load(address: str, token: str, names: list[str]) -> dict[str, float]:
    headers, service = {"Authorization": f"Bearer {token}"}, _find_service()
    listening = _start_listeners(f"{address.removesuffix('/api/v1')}#token={token}", names)
    before = sum(service.cpu_times()[:2])
    latencies = asyncio.run(measure_load(address, ROUTES, headers, CLIENTS, REQUESTS, SECONDS))
    busy = (sum(service.cpu_times()[:2]) - before) / SECONDS
    counts = json.loads(listening.communicate()[0])
    print(f"  {len(names)} benches: {len(latencies)} requests")
    print(f"    samples at each listener: {min(counts['received'])} to {max(counts['received'])}")
    lost = sum(counts["lost"])
    print(f"    lost: {lost} of {sum(counts['received']) + lost}")
    found = {
        "median [ms]": 1e3 * float(np.median(latencies)),
        "percentile 99 [ms]": 1e3 * float(np.percentile(latencies, 99)),
        "processor time of the service [s/s]": busy,
    }
    for name, value in found.items():
        print_line(f"    {name}", value, "", "")
    return found


def _make_catalogue(data: Path) -> Path:
    data.mkdir()
    engine = open_database(make_sqlite_url(data / CATALOGUE_FILE))
    fill_catalogue(engine, RUNS)
    engine.dispose()
    return data


def _start_listeners(url: str, names: list[str]) -> "subprocess.Popen[bytes]":
    seconds = str(SECONDS + _END)
    command = [sys.executable, "-m", "benchmarks.speed.benches", "listen", url, seconds, *names]
    return subprocess.Popen(command, stdout=subprocess.PIPE)


def _find_service() -> psutil.Process:
    """Return the process of the service, a child of this one."""
    return next(one for one in psutil.Process().children() if "serve" in one.cmdline())


def listen(url: str, seconds: float, names: list[str]) -> dict[str, Any]:
    """Count the samples of each bench, and those whose number is missing."""
    received, lost = [0] * len(names), [0] * len(names)

    def follow(place: int) -> None:
        end, expected = time.monotonic() + seconds, None
        for batch in Bench(url, name=names[place]).live():
            number = batch["number"]
            steps = np.diff(number, prepend=number[0] - 1 if expected is None else expected - 1)
            lost[place] += int(np.sum(steps - 1))
            received[place] += len(number)
            expected = number[-1] + 1
            if time.monotonic() > end:
                return

    threads = [threading.Thread(target=follow, args=(place,)) for place in range(len(names))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return {"received": received, "lost": lost}


if __name__ == "__main__":
    if sys.argv[1:2] == ["listen"]:
        print(json.dumps(listen(sys.argv[2], float(sys.argv[3]), sys.argv[4:])))
    else:
        run()

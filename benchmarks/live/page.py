"""Live data in the page: drawn frames, age of the samples in view, lost samples, with twenty listeners.

python -m benchmarks live_page

A run at 1 kHz is recorded over the wires of the simulated rig. Twenty listeners receive its samples: the page in
Chromium, eighteen clients that read, and one that never reads. The page is measured alone first, as the baseline.
"""

import contextlib
import json
import statistics
import threading
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from bench.client import Bench
from bench.demo import DemoFolder, start_processes
from bench.log import read_log
from benchmarks.common import print_line
from benchmarks.live.browser import MEASURE_PAGE, start_script

METHOD, SECONDS, READERS = "quick", 12.0, 18
"""Recorded method, measured time [s], clients that read beside the page and the one that does not."""


def run() -> None:
    """Print frames and ages with the page alone and with twenty listeners, and the lost samples of each run."""
    print(f"Live page: {METHOD} at 1 kHz, {SECONDS:g} s in Chromium without a graphics processor")
    with TemporaryDirectory() as path, start_processes(DemoFolder(Path(path), METHOD, None, 1)) as address:
        for title, readers in (("page alone", 0), ("twenty listeners, one stalled", READERS)):
            print(f"  {title}")
            with listen(address, readers) as counts:
                _measure_run(address, Path(path) / f"{readers}.mcap")
            if counts:
                print(f"  batches of each reader: {min(counts)} to {max(counts)}")


def _measure_run(address: str, log_path: Path) -> None:
    script = start_script(MEASURE_PAGE, address, str(SECONDS))
    assert script.stdout is not None
    assert script.stdout.readline() == "ready\n"
    recorded = Bench(address).start(METHOD, specimen="live")
    output, _ = script.communicate(timeout=300)
    print_view(json.loads(output))
    recorded.wait()
    log = read_log(recorded.download_log(log_path))
    lost = json.loads(log.metadata["outcome"]["lost"])
    print(f"    recording: {len(log.samples['time'])} samples, outcome {log.outcome}, lost: {lost or 'nothing'}")


def print_view(seen: dict[str, Any]) -> None:
    """Print frames and ages of the view that `measure_page.mjs` has measured."""
    print_line("  frames of the browser", seen["frames"] / seen["seconds"], "1/s", "")
    print_line("  drawn frames", seen["drawn"] / seen["seconds"], "1/s", "at least 50")
    ages = [age for age in seen["ages"] if age is not None]
    print_line("  age of the newest sample in view, median", statistics.median(ages), "ms", "at most 150")
    print_line("  the same, largest", max(ages), "ms", "")


@contextlib.contextmanager
def listen(address: str, readers: int) -> Iterator[list[int]]:
    """Run clients that read, and one that does not; yield the number of batches that each reader has received."""
    counts = [0] * readers
    stopping = threading.Event()
    threads = [threading.Thread(target=_read, args=(address, counts, k, stopping)) for k in range(readers)]
    with contextlib.ExitStack() as stack:
        if readers:
            stack.enter_context(_stall(address))
        for thread in threads:
            thread.start()
        yield counts
        stopping.set()
        for thread in threads:
            thread.join()


def _read(address: str, counts: list[int], k: int, stopping: threading.Event) -> None:
    for _ in Bench(address).live():
        counts[k] += 1
        if stopping.is_set():
            return


@contextlib.contextmanager
def _stall(address: str) -> Iterator[None]:
    """Keep a connection that signs in, acknowledges nothing, and whose buffer fills."""
    base, token = address.split("#token=")
    # The service has given up the connection by then, so that it does not answer the closing frame.
    with (
        contextlib.suppress(ConnectionClosed, TimeoutError),
        connect(f"{base.replace('http', 'ws')}api/v1/live", max_queue=1, close_timeout=1) as socket,
    ):
        socket.send(json.dumps({"token": token}))
        yield

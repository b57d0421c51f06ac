"""Delay until the page shows that agent, service or worker no longer answers.

python -m benchmarks dead_bench

A process is suspended (SIGSTOP) at random moments, at rest and during a run. That is harder to notice than its
end, because its connections stay open. The delay counts until the page in Chromium shows `No connection`, or that
the worker is not ready.
"""

import json
import os
import random
import signal
import subprocess
import threading
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import httpx2
import numpy as np
import psutil

from bench.client import Bench
from bench.demo import DemoFolder, start_processes
from benchmarks.common import print_line
from benchmarks.live.browser import WATCH_STATE, start_script

SEED, REPEATS, LONGEST = 21, 10, 60.0
"""Seed of the moments, repeats of each case, longest wait for a state [s]."""
HOLD = 3.0
"""Time for which a process stays suspended after the page has noticed it [s]."""
METHOD = "paper_sines"
LOST, READY, NOT_READY = "No connection", "worker ready", "worker not ready"


class StateWatch:
    """States of bench and worker that the page shows, with the UTC at which each appeared."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        """Read the output of `watch_state.mjs`."""
        self.seen: list[tuple[float, set[str]]] = []
        self._process = process
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        for line in self._process.stdout or ():
            change = json.loads(line)
            worker = READY if change["health"].get("Worker") == "ready" else NOT_READY
            self.seen.append((change["utc_s"], {change["word"], worker}))

    def wait_for(self, *words: str) -> float:
        """Return the UTC [s] at which the present state appeared, as soon as it has one of these words.

        Raises:
            TimeoutError: none of them appears.
        """
        end = time.monotonic() + LONGEST
        while not self.seen or not self.seen[-1][1].intersection(words):
            if time.monotonic() > end:
                raise TimeoutError(f"{words} not shown within {LONGEST:g} s; seen {self.seen[-3:]}")
            time.sleep(0.01)
        return self.seen[-1][0]

    def close(self) -> None:
        """End the browser."""
        self._process.communicate(timeout=LONGEST)


def run() -> None:
    """Print the delays of worker, agent and service, at rest and during a run."""
    print(f"Dead bench: time until the page shows {LOST!r} or {NOT_READY!r}, {REPEATS} random moments each")
    draw = random.Random(SEED)
    with TemporaryDirectory() as path, start_processes(DemoFolder(Path(path), METHOD, None, 1)) as address:
        watch = StateWatch(start_script(WATCH_STATE, address))
        try:
            watch.wait_for("Idle")
            at_rest = measure(watch, "worker", draw, lambda: watch.wait_for(READY), NOT_READY)
            _print_delays("worker at rest", at_rest)
            for name, word in (("rig", "agent"), ("serve", "service")):
                _print_delays(f"{word} at rest", measure(watch, name, draw, lambda: watch.wait_for("Idle")))
            for name, word in (("serve", "service"), ("rig", "agent")):
                _print_delays(f"{word} in a run", measure(watch, name, draw, lambda: _start_run(watch, address)))
        finally:
            watch.close()


def measure(
    watch: StateWatch, name: str, draw: random.Random, prepare: Callable[[], object], lost: str = LOST
) -> list[float]:
    """Return the delay [s] until a word is shown, for each repeat; `prepare` brings the bench into its state."""
    delays = []
    for _ in range(REPEATS):
        prepare()
        time.sleep(draw.uniform(0.5, 3.0))
        process = _find_process(name)
        began = time.time()
        process.send_signal(signal.SIGSTOP)
        try:
            delays.append(watch.wait_for(lost) - began)
            time.sleep(HOLD)
        finally:
            process.send_signal(signal.SIGCONT)
        watch.wait_for("Idle", "Running", "Tripped", "Stopping")
    return delays


def _start_run(watch: StateWatch, address: str) -> None:
    """Bring the bench into a run; the suspension of the agent trips the drive, which needs a reset."""
    base, token = address.split("#token=")
    watch.wait_for("Idle", "Running", "Tripped")
    words = watch.seen[-1][1]
    if "Running" in words:
        return
    if "Tripped" in words:
        headers = {"Authorization": f"Bearer {token}"}
        httpx2.post(f"{base}api/v1/bench/reset", headers=headers).raise_for_status()
        watch.wait_for("Idle")
    Bench(address).start(METHOD, specimen="dead")
    watch.wait_for("Running")


def _find_process(name: str) -> psutil.Process:
    """Return the descendant of this process that runs a command of mrbench."""
    for process in psutil.Process(os.getpid()).children(recursive=True):
        words = process.cmdline()
        if name in words and any("mrbench" in word or "bench.cli" in word for word in words):
            return process
    raise LookupError(f"no process of `mrbench {name}`")


def _print_delays(name: str, delays: list[float]) -> None:
    print_line(f"{name}, median", float(np.median(delays)), "s", "")
    print_line(f"{name}, largest of {len(delays)}", max(delays), "s", "at most 2")

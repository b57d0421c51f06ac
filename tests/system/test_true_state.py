"""State that the page shows while agent, service, worker or simulated rig is suspended or killed."""

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time

import psutil
import pytest

from bench.client import Bench
from tests.support.page_in_browser import CHROMIUM, FOLDER, NODE, browser_test

MRBENCH = (sys.executable, "-m", "bench.cli")
ENVIRONMENT = os.environ | {"MRBENCH_NICE": "0"}
DEADLINE = 120.0
LONG_METHOD = "paper_sines"
"""Ten minutes: a busy machine may show `No connection` for as long as the shortest method lasts."""
STATUS_AGE = 2.0
"""Largest age [s] of a status that the page shows, with the time of one frame on a busy machine."""
HOLD = 9.0
"""Time [s] for which a process stays suspended: longer than the silence after which the page connects again."""


def wait_for(condition, message):
    """Return what a condition returns as soon as it holds."""
    end = time.monotonic() + DEADLINE
    while not (found := condition()):
        assert time.monotonic() < end, message()
        time.sleep(0.05)
    return found


class Page:
    """Page in a browser, and what it has shown: lines of `watch_state.mjs`."""

    def __init__(self, address):
        command = [NODE, str(FOLDER / "watch_state.mjs"), address, CHROMIUM]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.lines = []
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self):
        for line in self.process.stdout:
            self.lines.append(json.loads(line))

    def wait_for(self, condition):
        """Wait until the line shown last fulfils a condition, and return it."""
        wait_for(lambda: self.lines and condition(self.lines[-1]), lambda: f"did not come: {self.lines[-5:]}")
        return self.lines[-1]

    def wait_for_word(self, word):
        self.wait_for(lambda line: line["word"] == word)

    def list_after(self, start):
        """Return the lines since a time [s, UTC].

        On a busy machine, a status from before the end of a process may arrive late. Until it is old, it is true.
        """
        return [line for line in self.lines if line["utc_s"] > start]

    def close(self):
        self.process.stdin.close()
        self.process.wait(60)
        self._reader.join()
        self.process.stdout.close()


def shows_status(line):
    """Return whether the page shows anything that only a status of the agent can say."""
    health = line["health"]
    known = [health.get(name) not in (None, "not known") for name in ("Wires", "Clocks")]
    return line["word"] != "No connection" or any(known) or line["done"] > 0 or line["enabled"] > 0


def shows_wires(line):
    """Return whether the page shows a run, or instruments that all answer.

    After its wire was lost, the amplifier keeps the fault that its zero output was not confirmed.
    """
    return line["word"] == "Running" or line["health"].get("Wires") in ("ready", "fault of coil_amplifier")


def shows_worker(line):
    """Return whether the page shows a worker that answers."""
    return line["health"].get("Worker") == "ready"


SIGNS = {"agent": shows_status, "service": shows_status, "wire": shows_wires, "worker": shows_worker}
"""Signs that the page must not show while a process is suspended or killed."""


def start(words, folder, name):
    with (folder / f"{name}.log").open("w") as log:
        return subprocess.Popen([*MRBENCH, *words], cwd=folder, stdout=log, stderr=log, env=ENVIRONMENT)


class RunningBench:
    """Processes of a bench by name, the page and a client."""

    def __init__(self, folder):
        self.folder, self.processes = folder, {}
        self.page = self.client = self.url = self.token = None

    def start(self):
        self.processes["wire"] = start(["sim", "--out", "bench.toml"], self.folder, "sim")
        wait_for((self.folder / "bench.toml").is_file, (self.folder / "sim.log").read_text)
        self.start_agent()
        words = ["serve", "--config", "bench.toml", "--port", "0", "--data", "runs"]
        self.processes["service"] = start(words, self.folder, "service")
        found = wait_for(lambda: find_address(self.folder), (self.folder / "service.log").read_text)
        self.url, self.token = found
        self.client, self.page = Bench(*found), Page(f"{self.url}/#token={self.token}")

    def start_agent(self):
        log = self.folder / "agent.log"
        log.unlink(missing_ok=True)
        self.processes["agent"] = start(["rig", "--config", "bench.toml"], self.folder, "agent")
        wait_for(lambda: "commands" in log.read_text(), log.read_text)

    def find(self, name):
        """Return a process; the worker is the one that the service has started last."""
        if name != "worker":
            return psutil.Process(self.processes[name].pid)
        return psutil.Process(self.find_started(name)[-1])

    def find_started(self, name):
        """Return the ids of the processes that the service has started, such as workers."""
        log = (self.folder / "service.log").read_text()
        return [int(number) for number in re.findall(rf"{name}_started pid=(\d+)", log)]

    def end(self):
        if self.page is not None:
            self.page.close()
        for name in ("service", "agent", "wire"):
            if process := self.processes.get(name):
                process.send_signal(signal.SIGCONT)
                process.send_signal(signal.SIGINT)
                process.wait(60)
        for number in self.find_started("agent"):
            with contextlib.suppress(psutil.NoSuchProcess):
                psutil.Process(number).kill()


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """Start the simulated rig, an agent and a service, and open the page."""
    bench = RunningBench(tmp_path_factory.mktemp("bench"))
    try:
        bench.start()
        yield bench
    finally:
        bench.end()


def find_address(folder):
    """Return address and token of the service, or None before they are known."""
    printed = re.search(r"(http://\S+?)/?(?:#token=(\S+))?(?:\s|$)", (folder / "service.log").read_text())
    if printed is None:
        return None
    file = folder / "runs" / "token"
    token = printed[2] or (file.read_text().strip() if file.exists() else None)
    return (printed[1], token) if token else None


@contextlib.contextmanager
def suspended(process):
    process.send_signal(signal.SIGSTOP)
    try:
        yield time.time()
    finally:
        process.send_signal(signal.SIGCONT)


def start_run(bench):
    bench.page.wait_for_word("Idle")
    bench.client.start(LONG_METHOD, "MR-0042")
    bench.page.wait_for_word("Running")


def check_absence(page, sign):
    """Check that the page stops to show a sign, and does not show it again."""
    page.wait_for(lambda line: not sign(line))
    noticed = time.time()
    time.sleep(HOLD)
    assert not any(map(sign, page.list_after(noticed)))
    assert not sign(page.lines[-1])


@browser_test
@pytest.mark.timeout(400)
@pytest.mark.parametrize("name", ["agent", "service", "worker", "wire"])
def test_a_suspended_process_is_never_shown_as_alive(bench, name):
    page, sign = bench.page, SIGNS[name]
    page.wait_for(lambda line: line["word"] == "Idle" and shows_wires(line) and shows_worker(line))
    with suspended(bench.find(name)) as stopped:
        check_absence(page, sign)
        if sign is shows_status:
            assert not any(map(sign, page.list_after(stopped + STATUS_AGE)))
    page.wait_for(lambda line: line["word"] != "No connection" and sign(line))


@browser_test
@pytest.mark.timeout(400)
def test_an_agent_killed_during_a_run_is_never_shown_as_running_again(bench):
    start_run(bench)
    bench.find("agent").kill()
    bench.processes["agent"].wait(30)
    killed = time.time()
    bench.page.wait_for(lambda line: not shows_status(line))
    time.sleep(HOLD)
    assert "Running" not in [line["word"] for line in bench.page.list_after(killed + STATUS_AGE)]

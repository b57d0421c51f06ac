"""State that the page shows while agent and service are suspended or killed, with all processes of a bench."""

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
    end = time.monotonic() + DEADLINE
    while not (found := condition()):
        assert time.monotonic() < end, message()
        time.sleep(0.05)
    return found


class Page:
    """Page in a browser, and the states that it has shown."""

    def __init__(self, address):
        command = [NODE, str(FOLDER / "watch_state.mjs"), address, CHROMIUM]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.words, self.times = [], []
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self):
        for line in self.process.stdout:
            change = json.loads(line)
            self.times.append(change["utc_s"])
            self.words.append(change["word"])

    def wait_for(self, word):
        wait_for(lambda: self.words[-1:] == [word], lambda: f"{word} did not come after {self.words}")

    def list_words_after(self, start):
        """Return the states shown since a time [s, UTC].

        On a busy machine, a status from before the end of a process may arrive late. Until it is old, it is true.
        """
        return [word for at, word in zip(self.times, self.words, strict=False) if at > start]

    def close(self):
        self.process.stdin.close()
        self.process.wait(60)
        self._reader.join()
        self.process.stdout.close()


def start(words, folder, name):
    with (folder / f"{name}.log").open("w") as log:
        return subprocess.Popen([*MRBENCH, *words], cwd=folder, stdout=log, stderr=log, env=ENVIRONMENT)


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """Start the simulated rig, an agent and a service, and open the page."""
    folder = tmp_path_factory.mktemp("bench")
    processes, page = [start(["sim", "--out", "bench.toml"], folder, "sim")], None
    try:
        wait_for((folder / "bench.toml").is_file, (folder / "sim.log").read_text)
        processes.append(start(["rig", "--config", "bench.toml"], folder, "agent"))
        wait_for(lambda: "commands" in (folder / "agent.log").read_text(), (folder / "agent.log").read_text)
        words = ["serve", "--config", "bench.toml", "--port", "0", "--data", "runs"]
        processes.append(start(words, folder, "service"))
        url, token = wait_for(lambda: find_address(folder), (folder / "service.log").read_text)
        page = Page(f"{url}/#token={token}")
        yield processes[1], processes[2], page, Bench(url, token)
    finally:
        if page is not None:
            page.close()
        for process in reversed(processes):
            process.send_signal(signal.SIGCONT)
            process.send_signal(signal.SIGINT)
        for process in reversed(processes):
            process.wait(60)


def find_address(folder):
    """Return address and token of the service, or None before they are known."""
    printed = re.search(r"(http://\S+?)/?(?:#token=(\S+))?(?:\s|$)", (folder / "service.log").read_text())
    if printed is None:
        return None
    file = folder / "runs" / "token"
    token = printed[2] or (file.read_text().strip() if file.exists() else None)
    return (printed[1], token) if token else None


@browser_test
@pytest.mark.timeout(400)
@pytest.mark.parametrize("which", [0, 1], ids=["agent", "service"])
def test_a_suspended_process_is_never_shown_as_alive(bench, which):
    process, page = bench[which], bench[2]
    page.wait_for("Idle")
    process.send_signal(signal.SIGSTOP)
    stopped = time.time()
    try:
        page.wait_for("No connection")
        time.sleep(HOLD)
        assert "Idle" not in page.list_words_after(stopped + STATUS_AGE)
        assert page.words[-1] == "No connection"
    finally:
        process.send_signal(signal.SIGCONT)
    page.wait_for("Idle")


@browser_test
@pytest.mark.timeout(400)
def test_an_agent_killed_during_a_run_is_never_shown_as_running_again(bench):
    agent, _, page, client = bench
    page.wait_for("Idle")
    client.start(LONG_METHOD, "MR-0042")
    page.wait_for("Running")
    psutil.Process(agent.pid).kill()
    agent.wait(30)
    killed = time.time()
    page.wait_for("No connection")
    time.sleep(HOLD)
    assert "Running" not in page.list_words_after(killed + STATUS_AGE)

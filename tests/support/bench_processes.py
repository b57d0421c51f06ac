"""Processes of a whole bench that tests may kill: simulated rig, service with its worker, and the agent.

The service starts agent and worker itself, so their ids are read from its log and from its children. Only these
processes are ever killed. Lifetimes are kept, so that statements of the service can be compared with them.
"""

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import time
from http.client import HTTPException
from pathlib import Path
from urllib.request import Request, urlopen

import psutil

from bench.client import Bench
from tests.support.quick_jobs import COMMAND as SERVICE_COMMAND

MRBENCH = (sys.executable, "-m", "bench.cli")
ENVIRONMENT = os.environ | {"MRBENCH_NICE": "0", "PYTHONPATH": str(Path(__file__).parents[2])}
"""Workers at normal priority: at the lowest they would wait for all other tests. The path is that of `tests`."""
DEADLINE = 180.0
"""Longest time [s] for what has to happen at some time, on a busy machine."""
PARTS = ("rig", "agent", "worker", "service")
_WORDS = {"agent": "rig", "worker": "worker"}
"""Word of the command line of what the service starts."""


def wait_for(condition, describe, pause=0.1):
    """Return what a condition returns as soon as it holds; it is checked again after a pause [s]."""
    end = time.monotonic() + DEADLINE
    while not (found := condition()):
        assert time.monotonic() < end, describe()
        time.sleep(pause)
    return found


class Lifetime:
    """Time during which a process existed, in UTC [s]; without an end while it exists."""

    def __init__(self, process):
        self.process, self.begin, self.end = process, process.create_time(), None

    def is_alive(self):
        if self.end is None:
            with contextlib.suppress(psutil.NoSuchProcess):
                if self.process.is_running() and self.process.status() != psutil.STATUS_ZOMBIE:
                    return True
            self.end = time.time()
        return False


class BenchProcesses:
    """Bench in a folder: ``bench.toml``, the data folder ``runs``, and the output of each process."""

    def __init__(self, folder):
        self.folder, self.toml, self.data = folder, folder / "bench.toml", folder / "runs"
        self.lifetimes = {name: [] for name in PARTS}
        self.token = self.client = None
        self._port, self._popen = 0, {}

    def start_rig(self):
        """Start the simulated rig, and wait for its ``bench.toml``: a killed one leaves its own."""
        before = self.toml.stat().st_mtime_ns if self.toml.exists() else 0
        self._start("rig", [*MRBENCH, "sim", "--out", self.toml.name])
        wait_for(lambda: self.toml.exists() and self.toml.stat().st_mtime_ns != before, lambda: self.read("rig"))

    def start_service(self):
        """Start the service at the same address each time, and wait until it answers."""
        words = ["serve", "--config", self.toml.name, "--port", str(self._port), "--data", self.data.name]
        length = len(self.read("service"))
        self._start("service", [*SERVICE_COMMAND, *words])

        def find_address():
            assert self.is_alive("service"), self.read("service")[-3000:]
            return re.search(r"http://127\.0\.0\.1:(\d+)/ ", self.read("service")[length:])

        self._port = int(wait_for(find_address, lambda: self.read("service")[-3000:])[1])
        self.token = (self.data / "token").read_text()
        self.client = Bench(self.url, self.token)
        wait_for(lambda: self.get("/health"), lambda: self.read("service")[-3000:])

    @property
    def url(self):
        """Address of the service."""
        return f"http://127.0.0.1:{self._port}"

    def get(self, path):
        """Return an answer of the service, or None if it refuses or does not answer."""
        return self._request(path, "GET")

    def post(self, path):
        """Return the answer to a request without a body, or None as `get` does."""
        return self._request(path, "POST")

    def kill(self, name):
        """Kill a process by ``SIGKILL`` if it exists; return whether it did."""
        alive = [one for one in self.find(name) if one.is_alive()]
        for one in alive:
            with contextlib.suppress(psutil.NoSuchProcess):  # it has just ended by itself
                one.process.kill()
        wait_for(lambda: not any(one.is_alive() for one in alive), lambda: f"{name} does not end")
        if name in self._popen:
            self._popen[name].wait()
        return bool(alive)

    def is_alive(self, name):
        return any(one.is_alive() for one in self.find(name))

    def find(self, name):
        """Return the lifetimes of a part, with that of a process that was started meanwhile."""
        known = {one.process.pid for one in self.lifetimes[name]}
        for process in self._list_started() if name in _WORDS else ():
            with contextlib.suppress(psutil.Error):
                is_wanted = _WORDS[name] in process.cmdline()[2:5] and process.cwd() == str(self.folder)
                if is_wanted and process.pid not in known:
                    self.lifetimes[name].append(Lifetime(process))
        return self.lifetimes[name]

    def read(self, name):
        """Return the output of a process."""
        path = self.folder / f"{name}.log"
        return path.read_text("utf-8", errors="replace") if path.exists() else ""

    def end(self):
        """End everything; the agent last but one, because it outlives its service."""
        for name in ("service", "agent", "rig"):
            for one in [one for one in self.find(name) if one.is_alive()]:
                with contextlib.suppress(psutil.Error):  # it has just ended, or is killed below
                    one.process.send_signal(signal.SIGINT)
                    one.process.wait(60)
        for name in PARTS:
            self.kill(name)

    def _start(self, name, command):
        with (self.folder / f"{name}.log").open("a") as log:
            process = subprocess.Popen(
                command, cwd=self.folder, stdout=log, stderr=log, env=ENVIRONMENT, start_new_session=True
            )
        self._popen[name] = process
        self.lifetimes[name].append(Lifetime(psutil.Process(process.pid)))

    def _list_started(self):
        """Return the processes that the services of this bench have started."""
        found = [int(pid) for pid in re.findall(r"(?:agent|worker)_started pid=(\d+)", self.read("service"))]
        with contextlib.suppress(psutil.Error, KeyError):
            found += [one.pid for one in psutil.Process(self._popen["service"].pid).children()]
        for pid in found:
            with contextlib.suppress(psutil.Error):
                yield psutil.Process(pid)

    def _request(self, path, method):
        headers = {"Authorization": f"Bearer {self.token}"}
        request = Request(f"{self.url}/api/v1{path}", headers=headers, method=method)
        with contextlib.suppress(OSError, HTTPException, ValueError), urlopen(request, timeout=20) as reply:
            return json.load(reply)
        return None

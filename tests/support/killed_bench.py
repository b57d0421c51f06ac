"""All processes of a bench, of which one or all are killed at a random moment, and what must be true afterwards.

Real are the simulated rig, the agent, the service and its worker; only the jobs are shortened by `quick_jobs`.
``python -m tests.support.killed_bench FOLDER KILLS SEED`` repeats it as often as wanted, for the evidence.
"""

import collections
import random
import subprocess
import sys
import time
from pathlib import Path

import httpx2
import psutil

from bench.log import read_log
from tests.support.quick_jobs import COMMAND

MRBENCH = (sys.executable, "-m", "bench.cli")
DEADLINE = 180.0
"""Longest wait for a state [s]."""
LATEST_KILL = 14.0
"""Latest moment of a kill after the start of a run [s]; run and jobs take about as long."""
VICTIMS = ("agent", "service", "worker", "rig", "all")
METHOD = {
    "schema": "mrbench.method/1",
    "name": "short",
    "title": "Two short strokes",
    "description": "For kills.",
    "rate_hz": 1000,
    "drive_kind": "coil_v",
    "limits": {"stroke_m": 0.02, "velocity_mps": 0.3, "acceleration_mps2": 6, "force_n": 1500, "drive": 0.5},
    "segments": [
        {
            "name": name,
            "checkpoint": True,
            "motion": {"kind": "sine", "amplitude_m": 0.01, "frequency_hz": 2},
            "cycles": 4,
            "drive": {"kind": "constant", "value": 0.2},
        }
        for name in ("first", "second")
    ],
}


class KilledBench:
    """Processes of a bench in one folder; as a context manager, it ends them."""

    def __init__(self, folder):
        self.folder, self.config, self.data = folder, folder / "bench.toml", folder / "runs"
        self.rig = self.service = None
        self.runs = []
        """Ids of all runs that the service has accepted."""

    def __enter__(self):
        self.start_missing()
        self.call("POST", "methods", json=METHOD)
        return self

    def __exit__(self, *_):
        for process in self.find("rig") + self.find("serve") + self.find("sim"):
            process.terminate()
        psutil.wait_procs(self.find("rig") + self.find("serve") + self.find("sim"), 30)

    def start_missing(self):
        """Start the rig and the service if they do not run; the service starts agent and worker itself."""
        if not self.find("sim"):
            self.config.unlink(missing_ok=True)
            self.start([*MRBENCH, "sim", "--out", str(self.config)])
            until(self.config.is_file, "the rig has not started")
        if not self.find("serve"):
            log = self.folder / "service.log"
            log.unlink(missing_ok=True)
            serve = ["serve", "--config", str(self.config), "--data", str(self.data), "--port", "0"]
            self.start([*COMMAND, *serve], log)
            until(lambda: " (the token is " in log.read_text(), "the service has not started")
            address = log.read_text().split("(the token is")[0].split()[-1]
            token = (self.data / "token").read_text()
            self.client = httpx2.Client(
                base_url=f"{address}api/v1/", headers={"Authorization": f"Bearer {token}"}, timeout=30
            )

    def start(self, words, log=None):
        output = (log or self.folder / "other.log").open("a")
        with output:
            subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=output, stderr=output, cwd=Path.cwd())

    def find(self, command):
        """Return the living processes of one command of mrbench that belong to this folder."""
        return [process for process in psutil.process_iter() if self.is_own(process, command)]

    def is_own(self, process, command):
        try:
            words = process.cmdline()
            is_alive = process.status() != psutil.STATUS_ZOMBIE
        except psutil.Error:
            return False
        return is_alive and command in words and any(str(self.folder) in word for word in words)

    def call(self, method, path, **more):
        reply = self.client.request(method, path, **more)
        assert reply.is_success, f"{method} {path}: {reply.status_code} {reply.text}"
        return reply.json()

    def recover(self):
        """Start what is missing, reset a trip as a person would, and wait until the bench is at rest."""
        self.start_missing()
        until(self.is_idle, "the bench is not at rest")

    def is_idle(self):
        try:
            reply = self.client.get("bench")
            if reply.is_success and reply.json()["state"] == "tripped":
                self.client.post("bench/reset")
            return reply.is_success and reply.json()["state"] == "idle" and not reply.json()["warnings"]
        except httpx2.TransportError:
            return False

    def start_run(self):
        run = self.call("POST", "runs", json={"method": "short", "specimen": "S"})
        self.runs.append(run["id"])

    def kill(self, victim):
        """Kill one process or all of them."""
        commands = {"agent": ["rig"], "service": ["serve"], "worker": ["worker"], "rig": ["sim"]}
        for command in commands.get(victim, ["serve", "rig", "worker", "sim"]):
            for process in self.find(command):
                process.kill()

    def has_settled(self):
        """Return whether every run has ended and no job is open."""
        jobs = self.call("GET", "jobs", params={"limit": 200})["items"]
        runs = [self.call("GET", f"runs/{run}") for run in self.runs]
        return not any(one["state"] in ("queued", "running") for one in jobs + runs)

    def check(self):
        """Check that each accepted run has ended, with a readable log and one result per job; count outcomes."""
        until(self.has_settled, "runs or jobs have not ended")
        outcomes = collections.Counter(self.check_run(self.call("GET", f"runs/{run}")) for run in self.runs)
        assert not list(self.data.glob(".*.part")), "the folder of an attempt still exists"
        return outcomes

    def check_run(self, run):
        if not (self.data / run["log"]).is_file():
            assert run["outcome"] == "incomplete", run
            return "no log"
        if run["state"] == "truncated":
            run = self.call("POST", f"runs/{run['id']}/salvage")
        log = read_log(self.data / run["log"])
        assert log.outcome == run["outcome"]
        if run["outcome"] == "clean" and run["ending"] == "completed":
            kinds = collections.Counter(job["kind"] for job in run["jobs"])
            assert kinds == {"identify": 1, "diagnose": 1}, run["jobs"]
            assert all(job["state"] == "done" for job in run["jobs"]), run["jobs"]
            for folder in ("fit", "diagnosis"):
                assert len(list(self.data.glob(f"{Path(run['log']).stem}.{folder}-*"))) == 1
        return run["outcome"]


def until(condition, message):
    end = time.monotonic() + DEADLINE
    while not condition():
        assert time.monotonic() < end, message
        time.sleep(0.1)


def kill_at_random(folder, kills, seed):
    """Kill a process at a random moment of runs and jobs, some times; return victims and outcomes of the runs."""
    draw, victims = random.Random(seed), collections.Counter()
    with KilledBench(folder) as bench:
        for _ in range(kills):
            bench.recover()
            bench.start_run()
            time.sleep(draw.uniform(0.0, LATEST_KILL))
            victim = draw.choice(VICTIMS)
            bench.kill(victim)
            victims[victim] += 1
        bench.recover()
        return victims, bench.check()


def main():
    folder, kills, seed = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    began = time.monotonic()
    victims, outcomes = kill_at_random(folder.absolute(), kills, seed)
    print(f"{kills} kills in {time.monotonic() - began:.0f} s: {dict(victims)}; outcomes {dict(outcomes)}")


if __name__ == "__main__":
    main()

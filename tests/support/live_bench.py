"""Simulated rig with its wires in this process, and agents in processes of their own."""

import contextlib
import gc
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from bench.agent_protocol import ShutDownCommand, StatusCommand
from bench.agent_protocol.agent_client import AgentClient
from bench.agent_protocol.endpoint import find_agent
from bench.log.reader import read_log
from bench.rig.priority import raise_priority
from sim_rig.live.clock import RunningClock
from sim_rig.scenario.scenario import load_scenario
from sim_rig.server.bench_toml import write_bench_toml
from sim_rig.server.server import RigServer, TransportOptions

COMMAND = Path(sys.executable).parent / "mrbench"
DEADLINE = 90.0
ENVIRONMENT = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])}
"""Environment of processes; the path is that of `tests`."""


TCP = TransportOptions(load_cell="tcp")
_TOLERANT_DRIVE = "setpoint_timeout = 0.5\nfollowing_error_window = 0.02"
"""Setpoint timeout [s] and following error [m] that a simulated drive needs on a slow or busy machine."""


def constant(value):
    return {"kind": "constant", "value": value}


def method(**more):
    """Return a method of a few seconds with strokes at two drives."""
    sine = {"kind": "sine", "amplitude_m": 0.008, "frequency_hz": 2.0}
    return {
        "schema": "mrbench.method/1",
        "name": "short",
        "title": "Short",
        "description": "Two stretches.",
        "rate_hz": 1000.0,
        "drive_kind": "coil_v",
        "limits": {
            "stroke_m": 0.02, "velocity_mps": 2.0, "acceleration_mps2": 8.0, "force_n": 1500.0, "drive": 0.5,
        },
        "segments": [
            {"name": "a", "motion": sine, "cycles": 3, "drive": constant(0.2), "checkpoint": True},
            {"name": "b", "motion": sine, "cycles": 4, "drive": constant(0.4)},
        ],
        **more,
    }  # fmt: skip


class Bench:
    """Served rig, its bench.toml, and the true signals of its plant."""

    def __init__(self, served, folder):
        self.served, self.folder = served, folder
        self.toml = folder / "bench.toml"

    def write_method(self, **more):
        path = self.folder / "short.json"
        path.write_text(json.dumps(method(**more)))
        return path

    def run(self, *words, **more):
        """Start ``mrbench run`` on this bench."""
        return subprocess.Popen(
            [COMMAND, "run", self.write_method(**more), "--config", self.toml, "--out", self.log, *words],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    @property
    def log(self):
        return self.folder / "run.mcap"

    def truth(self):
        return self.served.rig.read_truth().truth

    def strokes(self):
        """Return whether the rod moves with the coil on."""
        truth = self.truth()
        return len(truth.output) > 100 and truth.output[-1] > 0.1 and np.ptp(truth.position[-400:]) > 4e-3

    def rests(self):
        """Return whether the rod has been at rest for 0.2 s with the coil off."""
        truth = self.truth()
        return np.all(truth.output[-200:] == 0) and np.ptp(truth.position[-400:]) < 1e-6


def until(condition, deadline=DEADLINE):
    """Poll until a condition holds."""
    end = time.monotonic() + deadline
    while not condition():
        assert time.monotonic() < end, "the condition did not become true in time"
        time.sleep(0.05)


@contextlib.contextmanager
def raised_priority():
    """Give threads of this process real-time priority if possible, and switch between them often."""
    before = sys.getswitchinterval()
    raise_priority(-10)
    sys.setswitchinterval(5e-4)
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
        sys.setswitchinterval(before)
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


@contextlib.contextmanager
def live_bench(folder, choices=TCP, faults=None, limits="", scenario=None):
    """Serve a rig on its wires; it plays the default scenario unless another one is given."""
    scenario = scenario or load_scenario("default")
    with raised_priority(), RigServer(scenario, RunningClock(), choices, faults) as served:
        until(lambda: len(served.rig.read_truth().truth.output) > 500)
        write_bench_toml(folder / "bench.toml", served.wires, scenario)
        bench = Bench(served, folder)
        text = bench.toml.read_text().replace("setpoint_timeout = 0.2", _TOLERANT_DRIVE)
        bench.toml.write_text(f"{text}{limits}\n")
        yield bench


def make_force_scenario(**changes):
    """Return the default scenario with other settings of the load cell."""
    scenario = load_scenario("default")
    force = scenario.sensors.force.model_copy(update=changes)
    return scenario.model_copy(update={"sensors": scenario.sensors.model_copy(update={"force": force})})


def record_check(folder, scenario, name, segments):
    """Record a check with nothing clamped, by `mrbench run` on a rig of its own; return the log."""
    folder.mkdir()
    with (
        live_bench(folder, scenario=scenario) as bench,
        ended(bench.run("--specimen", "none", name=name, segments=segments)) as process,
    ):
        _, output = process.communicate(timeout=DEADLINE)
        assert process.returncode == 0, output
        return read_log(bench.log)


@contextlib.contextmanager
def served_agent(bench, command=(COMMAND,)):
    """Start a rig agent on a bench, by another command if one is given, and return its client.

    The agent has a process of its own, as in use: together with the simulated rig it would share one interpreter
    lock, and a slow machine could not keep the instruments' time limits.
    """
    words = [*command, "rig", "--config", bench.toml]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT)
    with ended(process):
        assert "commands ipc://" in process.stdout.readline()
        agent = AgentClient(*find_agent(bench.toml))
        yield agent
        agent.send(ShutDownCommand())
        assert process.wait(DEADLINE) == 0


def fetch_status(agent):
    """Return the present status of an agent."""
    return agent.send(StatusCommand()).status


def until_segment(agent, name):
    """Wait until an agent's run is in a segment."""

    def is_reached():
        run = fetch_status(agent).run
        assert run.outcome is None, f"the run ended before segment {name}: {run.reason}"
        return run.segment == name

    until(is_reached)


def until_ended(agent):
    """Wait for the end of an agent's run and return the status after it."""
    until(lambda: (run := fetch_status(agent).run) is not None and run.outcome is not None)
    return fetch_status(agent)


@contextlib.contextmanager
def ended(process):
    """Kill a process at the end."""
    try:
        yield process
    finally:
        process.kill()
        process.communicate(timeout=DEADLINE)

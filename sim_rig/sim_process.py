"""The process of the simulated rig: from its start to the signal that ends it."""

import gc
import signal
import sys
import threading
from pathlib import Path
from typing import NamedTuple

import typer

from sim_rig.clock import RunningClock
from sim_rig.errors import SimRigError
from sim_rig.scenario import Scenario
from sim_rig.serve import Choices, Faults, ServedRig, table, write_bench_toml

_BLOCK = 2
"""Samples that the plant lets come together in real time."""
_SWITCH = 5e-4
"""[s] after which a thread that computes lets another one go on: wires do not wait for the plant."""
_LOOK = 0.2
"""[s] between two looks at whether the plant still moves."""


class Settings(NamedTuple):
    """How the rig is to be served."""

    choices: Choices
    faults: Faults
    speed: float


def run_until_stopped(scenario: Scenario, out: Path, settings: Settings) -> None:
    """Serve a rig, say where, and end with Ctrl-C or SIGTERM.

    Raises:
        WireError: a wire cannot be opened, or ``out`` not be written.
        PlantError: the specimen has no finite motion.
    """
    stopping = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stopping.set())
    block = max(_BLOCK, round(_BLOCK * settings.speed))
    clock = RunningClock(settings.speed)
    with ServedRig(scenario, clock, settings.choices, settings.faults, block) as served:
        write_bench_toml(out, served.wires)
        _spare_the_wires()
        typer.echo(f"{table(served.wires)}\n{out} reaches them all; Ctrl-C ends the rig")
        sys.stdout.flush()
        while not stopping.wait(_LOOK):
            if served.rig.failure is not None:
                raise served.rig.failure
    if isinstance(served.rig.failure, SimRigError):
        raise served.rig.failure


def _spare_the_wires() -> None:
    """Let no thread hold the others up: a search of all that was imported for garbage takes 70 ms."""
    sys.setswitchinterval(_SWITCH)
    gc.collect()
    gc.freeze()

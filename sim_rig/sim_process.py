"""The process of the simulated rig: from its start to the signal that ends it."""

import contextlib
import gc
import os
import signal
import sys
import threading
from pathlib import Path
from typing import NamedTuple

import typer

from sim_rig.clock import RunningClock
from sim_rig.errors import SimRigError, WireError
from sim_rig.scenario import Scenario
from sim_rig.serve import Choices, Faults, ServedRig, table, write_bench_toml

_BLOCK = 4
"""Samples that the plant lets come together in real time."""
_SWITCH = 5e-4
"""[s] after which a thread that computes lets another one go on: wires do not wait for the plant."""
_PRIORITY = 10
"""Of SCHED_FIFO: hardware is on time whatever the machine is busy with; an agent beside it stands higher."""
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
    broken = _end_with_any_thread(stopping)
    _remove(out)
    block = max(_BLOCK, round(_BLOCK * settings.speed))
    clock = RunningClock(settings.speed)
    rig = ServedRig(scenario, clock, settings.choices, settings.faults, block)
    _ahead_of_ordinary_work()
    with rig as served:
        # Only now: whoever waits for the file connects as soon as it is there.
        write_bench_toml(out, served.wires, scenario)
        _spare_the_wires()
        typer.echo(f"{table(served.wires)}\n{out} reaches them all; Ctrl-C ends the rig")
        sys.stdout.flush()
        while not stopping.wait(_LOOK):
            if served.rig.failure is not None:
                raise served.rig.failure
        if broken:
            raise broken[0]
    if isinstance(served.rig.failure, SimRigError):
        raise served.rig.failure


def _end_with_any_thread(stopping: threading.Event) -> list[BaseException]:
    """End the rig when one of its threads ends by an error, which is kept."""
    # A wire that nobody serves any more looks like a silent instrument, and is searched for on the wrong side.
    broken: list[BaseException] = []

    def end(thread: threading.ExceptHookArgs) -> None:
        if thread.exc_value is not None:
            broken.append(thread.exc_value)
        stopping.set()

    threading.excepthook = end
    return broken


def _remove(out: Path) -> None:
    """Remove what an earlier rig has left: it would lead whoever waits for the file to ports that are closed."""
    try:
        out.unlink(missing_ok=True)
    except OSError as error:
        raise WireError(
            f"{out}: cannot be replaced ({error.strerror}); choose another place with --out"
        ) from error


def _ahead_of_ordinary_work() -> None:
    """Real-time priority for this thread and all that it starts; without, the rig is as late as the machine."""
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))


def _spare_the_wires() -> None:
    """Let no thread hold the others up: a search of all that was imported for garbage takes 70 ms."""
    sys.setswitchinterval(_SWITCH)
    gc.collect()
    gc.freeze()

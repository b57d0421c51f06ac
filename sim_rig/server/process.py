"""Process of the simulated rig, from its start to the signal that ends it."""

import contextlib
import gc
import os
import signal
import sys
import threading
from pathlib import Path
from typing import NamedTuple

import typer

from sim_rig.errors import SimRigError
from sim_rig.live import RunningClock
from sim_rig.scenario import Scenario
from sim_rig.server.bench_toml import format_table, remove_bench_toml, write_bench_toml
from sim_rig.server.server import RigServer, TransportOptions, WireFaults

_BATCH_SAMPLES = 4
"""Samples that the plant simulates together in real time."""
_SWITCH_INTERVAL = 5e-4
"""[s] switch interval of the interpreter: short, so that wires do not wait for the plant."""
_REALTIME_PRIORITY = 10
"""Priority of SCHED_FIFO: hardware is on time under any load. An agent on the same machine has a higher one."""


class ServerSettings(NamedTuple):
    """Transports, wire faults and speed of the rig."""

    transports: TransportOptions
    faults: WireFaults
    speed: float
    poll_period: float = 0.2
    """Interval [s] at which the plant is checked for a failure."""


def run_until_stopped(scenario: Scenario, out: Path, settings: ServerSettings) -> None:
    """Serve a rig, print and write its addresses, and end with Ctrl-C or SIGTERM.

    Raises:
        WireError: a wire cannot be opened, or ``out`` cannot be written.
        PlantError: the specimen has no finite motion.
    """
    stopping = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stopping.set())
    thread_errors = _stop_on_thread_failure(stopping)
    remove_bench_toml(out)
    # In proportion to the speed, so that the batches per second of real time stay the same.
    batch = max(_BATCH_SAMPLES, round(_BATCH_SAMPLES * settings.speed))
    clock = RunningClock(settings.speed)
    rig = RigServer(scenario, clock, settings.transports, settings.faults, batch)
    _set_realtime_priority()
    with rig as served, contextlib.ExitStack() as written:
        # Written only now, as a waiting process connects as soon as the file exists.
        write_bench_toml(out, served.wires, scenario)
        # Before the wires close, as its addresses are void then.
        written.callback(remove_bench_toml, out)
        _reduce_latency()
        typer.echo(f"{format_table(served.wires)}\n{out} reaches them all; Ctrl-C ends the rig")
        sys.stdout.flush()
        while not stopping.wait(settings.poll_period):
            if served.rig.failure is not None:
                raise served.rig.failure
        if thread_errors:
            raise thread_errors[0]
    if isinstance(served.rig.failure, SimRigError):
        raise served.rig.failure


def _stop_on_thread_failure(stopping: threading.Event) -> list[BaseException]:
    """End the rig when one of its threads ends by an error; return the list that collects these errors."""
    # Otherwise a wire that is no longer served would look like a silent instrument.
    thread_errors: list[BaseException] = []

    def end(thread: threading.ExceptHookArgs) -> None:
        if thread.exc_value is not None:
            thread_errors.append(thread.exc_value)
        stopping.set()

    threading.excepthook = end
    return thread_errors


def _set_realtime_priority() -> None:
    """Give real-time priority to this thread and those it starts; without permission the rig may be late."""
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_REALTIME_PRIORITY))


def _reduce_latency() -> None:
    """Shorten thread switches, and exclude imported objects from garbage collection, which takes 70 ms."""
    sys.setswitchinterval(_SWITCH_INTERVAL)
    gc.collect()
    gc.freeze()

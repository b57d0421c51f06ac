"""Leads the rod to a place where no run does: to where a specimen is to be clamped, to its middle."""

import threading
import time
from collections.abc import Callable

from bench.errors import RunError
from bench.sequencer.lead import Lead, LeadThread
from bench.sequencer.plan import RunPlan
from bench.sequencer.track import approach
from drivers.actuator import Actuator

_LOOK = 0.02
"""[s] between two looks whether it stands."""
_SPARE = 10.0
"""[s] that the way may take beyond its plan."""
_STOP_ACCELERATION = 1.0
"""[m/s²] at which a stop lets the slow motion fade out."""


def move_rod(
    actuator: Actuator,
    permit: Callable[[float], None],
    clock: Callable[[], int],
    led: Callable[[bool], None],
    target: float,
    ending: threading.Event,
) -> None:
    """Go to a place softly, and leave the drive without voltage.

    Args:
        actuator: whose reference is known.
        permit: has the last word on each position [m]; raises to forbid it.
        clock: of the bench [ns].
        led: told whether the rod is led.
        target: [m] from the centre, or from home before a specimen is centred.
        ending: set by whoever wants it to end early.

    Raises:
        RunError: it was broken off, or does not arrive.
        DriverError: the drive refuses, or has gone; the place is forbidden.
    """
    permit(target)
    if ending.is_set():
        raise RunError("the move was broken off before it began")
    settings = actuator.settings
    lead = Lead(actuator, permit, RunPlan(), settings.cycle, settings.stale_after)
    thread = LeadThread(lead, clock, lambda now_ns, late: None, lambda error: None)
    way = approach(actuator.arm(), target)
    lead.play(way)
    led(True)
    stands = False
    try:
        with thread:
            _await_rest(lead, thread, clock, time.monotonic() + way.duration + _SPARE, ending)
        stands = thread.failure is None
    finally:
        led(False)
        # A rod that may still move is braked by the drive; without voltage it would coast.
        actuator.rest() if stands else actuator.make_safe()
    if thread.failure is not None:
        raise thread.failure
    if ending.is_set():
        raise RunError("the move was broken off; the rod stands on the way")


def _await_rest(
    lead: Lead, thread: LeadThread, clock: Callable[[], int], deadline: float, ending: threading.Event
) -> None:
    """Until the rod stands, or nobody leads it any more."""
    stopped = False
    while not lead.done(clock()) and thread.failure is None:
        if ending.is_set() and not stopped:
            lead.stop(clock(), _STOP_ACCELERATION)
            stopped = True
        if time.monotonic() > deadline:
            raise RunError(f"the rod has not arrived {_SPARE:g} s after its plan; see the actuator")
        time.sleep(_LOOK)

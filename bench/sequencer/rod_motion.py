"""Single move of the rod without a run, such as to the position where a specimen is clamped."""

import threading
import time
from collections.abc import Callable

from bench.errors import RunError
from bench.sequencer.command_history import CommandHistory
from bench.sequencer.setpoint_thread import SetpointGenerator, SetpointThread
from bench.sequencer.trajectory import plan_approach
from drivers.actuator import Actuator

_POLL_PERIOD = 0.02
"""[s] Interval at which the end of the move is polled."""
_STOP_ACCELERATION = 1.0
"""[m/s²] Acceleration limit of a soft stop of the slow move."""


def move_rod(
    actuator: Actuator,
    permit: Callable[[float], None],
    clock: Callable[[], int],
    on_setpoints_active: Callable[[bool], None],
    target: float,
    stop_requested: threading.Event,
    time_margin: float = 10.0,
) -> None:
    """Move the rod slowly to a position, and leave the drive without voltage.

    Args:
        actuator: referenced actuator.
        permit: checks each position [m] and raises to forbid it.
        clock: bench clock [ns].
        on_setpoints_active: receives True when setpoints begin and False when they end.
        target: position [m] from the specimen's middle, or from home if no specimen is centred.
        stop_requested: event that ends the move early.
        time_margin: time by which the move may exceed its planned duration [s].

    Raises:
        RunError: the move was stopped, or the rod does not arrive.
        InterlockError: the target is forbidden.
        DriverError: the drive refuses or does not reply.
    """
    permit(target)
    if stop_requested.is_set():
        raise RunError("the move was stopped before it began; the rod did not move")
    settings = actuator.settings
    generator = SetpointGenerator(actuator, permit, CommandHistory(), settings.cycle, settings.setpoint_timeout)
    # The failure is raised below, and a late setpoint of a slow move has no consequence.
    thread = SetpointThread(generator, clock, lambda now_ns, delay: None, lambda error: None)
    approach = plan_approach(actuator.arm(), target)
    generator.start(approach)
    on_setpoints_active(True)
    is_at_rest = False
    try:
        with thread:
            if not _await_rest(generator, thread, clock, approach.duration + time_margin, stop_requested):
                late = f"{time_margin:g} s after the planned end of the move"
                raise RunError(f"the rod has not arrived {late}; check the actuator")
        is_at_rest = thread.failure is None
    finally:
        on_setpoints_active(False)
        # The drive brakes a rod that may still move; without voltage the rod would coast.
        unconfirmed = _switch_off(actuator, is_at_rest)
    if unconfirmed:
        raise RunError(f"the move has ended, but the rod's rest is not confirmed: {unconfirmed}")
    if thread.failure is not None:
        raise thread.failure
    if stop_requested.is_set():
        raise RunError("the move was stopped; the rod rests before its target")


def _switch_off(actuator: Actuator, is_at_rest: bool) -> str:
    """Remove the voltage at rest, else stop the rod; return why its rest is not confirmed, or an empty text."""
    if not is_at_rest:
        return actuator.make_safe()
    actuator.disable()
    return ""


def _await_rest(
    generator: SetpointGenerator,
    thread: SetpointThread,
    clock: Callable[[], int],
    timeout: float,
    stop_requested: threading.Event,
) -> bool:
    """Wait until the rod is at rest or the setpoints have failed; return False after the timeout [s]."""
    deadline, is_stopping = time.monotonic() + timeout, False
    while not generator.is_done(clock()) and thread.failure is None:
        if stop_requested.is_set() and not is_stopping:
            generator.stop(clock(), _STOP_ACCELERATION)
            is_stopping = True
        if time.monotonic() > deadline:
            return False
        time.sleep(_POLL_PERIOD)
    return True

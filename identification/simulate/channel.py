"""What stands between the damper's own force and the recorded one: forces beside the law, inertia, the channel."""

from functools import partial
from typing import Any

import numpy as np

from identification.arrays import Array, compiled
from identification.damper.effects import Form
from identification.simulate.curves import lagged, over_number, over_parameters
from identification.simulate.inputs import remembered
from identification.simulate.motion import Motion, machine
from identification.simulate.setting import Setting, Stroke

_DISPLACEMENT_STEP, _VELOCITY_STEP = 1e-8, 1e-7
"""[m], [m/s] of differences of forces beside the law."""
_ACCELERATION_STEP = 1e-3
"""[m/s^2] of differences of inertia."""
_LAG_STEP = 1e-7
"""[s] of differences of the channel's lag."""
_STILL = 1e-6
"""[m] to either side that a lip does not feel: the noise of a rest would wear away what it keeps."""


def beside(setting: Setting, motion: Motion, h: float) -> Array:
    """(N,) sum of the forces beside the law [N]; samples are h [s] apart."""
    total = np.zeros(len(motion.x))
    for _, form, values in setting.acting("parallel_force"):
        total += form.act(motion.x, motion.v, *values)
    for _, form, values in setting.acting("dragging_force", "relaxing_force"):
        total += _remembering(form, h, motion.x, motion.v, *values)
    return total


def _remembering(form: Form, h: float, x: Array, v: Array, *values: float) -> Array:
    """(N,) force [N] beside the law of a form that remembers the way, or follows it in time."""
    if form.acts == "relaxing_force":
        exchange = values[[q.symbol for q in form.parameters].index("exchange")]
        return np.asarray(form.act(x, v, lagged(x, exchange, h), *values))
    return np.asarray(form.act(x, v, remembered(machine(form.memory), _felt(x, _STILL), *values), *values))


@compiled
def _felt(x: Array, still: float) -> Array:
    """(N,) displacement [m] that follows another one only where that goes beyond so much to either side."""
    found = np.empty(len(x))
    held = x[0]
    for i in range(len(x)):
        held = min(max(held, x[i] - still), x[i] + still)
        found[i] = held
    return found


def beside_slopes(setting: Setting, motion: Motion, h: float) -> tuple[Array, list[tuple[int, Array]]]:
    """Slopes of ``beside`` over the motion's unknowns (M, N), and over parameters by their columns."""
    moving, own = np.zeros_like(motion.dx), []
    for at, form, values in setting.acting("parallel_force"):
        over_x, over_v = _over_motion(form, values, motion)
        moving += over_x * motion.dx + over_v * motion.dv
        rows = over_parameters(partial(form.act, motion.x, motion.v), values, form.parameters)
        own += [(at + k, np.broadcast_to(row, len(motion.x))) for k, row in enumerate(rows)]
    for at, form, values in setting.acting("dragging_force", "relaxing_force"):
        moving += np.stack(
            [_along(form, h, values, motion, dx, dv) for dx, dv in zip(motion.dx, motion.dv, strict=True)]
        )
        whole = partial(_remembering, form, h, motion.x, motion.v)
        own += [(at + k, row) for k, row in enumerate(over_parameters(whole, values, form.parameters))]
    return moving, own


def _along(form: Form, h: float, values: tuple[float, ...], motion: Motion, dx: Array, dv: Array) -> Array:
    """(N,) slope of a force that remembers the way, over an unknown that moves the motion by dx and dv."""
    step = _DISPLACEMENT_STEP / max(float(np.abs(dx).max()), 1e-9)
    ahead, back = (_remembering(form, h, motion.x + s * dx, motion.v + s * dv, *values) for s in (step, -step))
    return np.asarray((ahead - back) / (2.0 * step))


def _over_motion(form: Form, values: tuple[float, ...], motion: Motion) -> tuple[Array, Array]:
    over_x = over_number(lambda x: form.act(x, motion.v, *values), motion.x, _DISPLACEMENT_STEP)
    over_v = over_number(lambda v: form.act(motion.x, v, *values), motion.v, _VELOCITY_STEP)
    return over_x, over_v


def recorded(
    setting: Setting, stroke: Stroke, motion: Motion, force: Array, J: Array | None, first: int, delays: list[int]
) -> Array:
    """The force as the channel sees it; its slopes are moved along in place.

    Args:
        setting, stroke, motion: as in the trajectory.
        force: (N,) of the damper on its mounting [N].
        J: (N, U) its slopes; None where they are not asked for.
        first: column of the effects' first parameter.
        delays: columns that the delay of the motion moves.

    Returns:
        (N,) [N].
    """
    # In the order of the chain: the channel's lag comes last and holds back all that was added before it.
    for at, form, values in setting.acting("inertia"):
        force = force + form.act(motion.a, *values)
        if J is not None:
            _add_columns(J, first + at, partial(form.act, motion.a), form, values)
            steepness = _over_acceleration(form, values, motion)
            J[:, delays] += (steepness * motion.da)[:, None]
            for early, _, _ in setting.acting("displacement_shift"):
                # A displacement that is late is a force that is early.
                J[:, first + early] -= steepness * motion.da
    for at, form, values in setting.acting("added_force"):
        force = force + form.act(stroke.time, stroke.drive_seen, *values)
        if J is not None:
            _add_columns(J, first + at, partial(form.act, stroke.time, stroke.drive_seen), form, values)
    for at, _, values in setting.acting("force_lag"):
        force = _lagged_with_slopes(force, values[0], 1.0 / stroke.rate, J, first + at)
    return force


def _over_acceleration(form: Form, values: tuple[float, ...], motion: Motion) -> Array:
    return np.asarray(over_number(lambda a: form.act(a, *values), motion.a, _ACCELERATION_STEP))


def _add_columns(J: Array, at: int, function: Any, form: Form, values: tuple[float, ...]) -> None:
    for k, row in enumerate(over_parameters(function, values, form.parameters)):
        J[:, at + k] += row


def _lagged_with_slopes(force: Array, lag: float, h: float, J: Array | None, at: int) -> Array:
    """The force behind a first-order lag; slopes J are lagged in place."""
    found = lagged(force, lag, h)
    if J is not None:
        J[:] = lagged(J, lag, h)
        # No channel is early: at a lag of zero the difference is one-sided.
        lower = max(lag - _LAG_STEP, 0.0)
        J[:, at] = (lagged(force, lag + _LAG_STEP, h) - lagged(force, lower, h)) / (lag + _LAG_STEP - lower)
    return found

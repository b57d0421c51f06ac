"""What stands between the damper's own force and the recorded one: forces beside the law, inertia, the channel."""

from functools import partial
from typing import Any

import numpy as np

from identification.arrays import Array, njit_cached
from identification.damper.effects import Form
from identification.simulate.curves import apply_lag, differentiate_by_argument, differentiate_by_parameters
from identification.simulate.inputs import trace_memory
from identification.simulate.motion import DamperMotion, compile_once
from identification.simulate.simulation_model import Excitation, SimulationModel

_DISPLACEMENT_STEP, _VELOCITY_STEP = 1e-8, 1e-7
"""[m], [m/s] of differences of forces beside the law."""
_ACCELERATION_STEP = 1e-3
"""[m/s^2] of differences of inertia."""
_LAG_STEP = 1e-7
"""[s] of differences of the channel's lag."""
_DEADBAND = 1e-6
"""[m] to either side that a lip does not feel: the noise of a rest would wear away what it keeps."""


def compute_parallel_force(setting: SimulationModel, motion: DamperMotion, h: float) -> Array:
    """(N,) sum of the forces beside the law [N]; samples are h [s] apart."""
    total = np.zeros(len(motion.x))
    for _, form, values in setting.select_forms("parallel_force"):
        total += form.function(motion.x, motion.v, *values)
    for _, form, values in setting.select_forms("hysteretic_force", "relaxation_force"):
        total += _compute_memory_force(form, h, motion.x, motion.v, *values)
    return total


def _compute_memory_force(form: Form, h: float, x: Array, v: Array, *values: float) -> Array:
    """(N,) force [N] beside the law of a form that remembers the way, or follows it in time."""
    if form.action == "relaxation_force":
        exchange = values[[q.symbol for q in form.parameters].index("exchange_time")]
        return np.asarray(form.function(x, v, apply_lag(x, exchange, h), *values))
    return np.asarray(
        form.function(
            x, v, trace_memory(compile_once(form.memory), _apply_deadband(x, _DEADBAND), *values), *values
        )
    )


@njit_cached
def _apply_deadband(x: Array, still: float) -> Array:
    """(N,) displacement [m] that follows another one only where that goes beyond so much to either side."""
    found = np.empty(len(x))
    held = x[0]
    for i in range(len(x)):
        held = min(max(held, x[i] - still), x[i] + still)
        found[i] = held
    return found


def differentiate_parallel_force(
    setting: SimulationModel, motion: DamperMotion, h: float
) -> tuple[Array, list[tuple[int, Array]]]:
    """Slopes of ``beside`` over the motion's unknowns (M, N), and over parameters by their columns."""
    moving, own = np.zeros_like(motion.dx), []
    for at, form, values in setting.select_forms("parallel_force"):
        over_x, over_v = _differentiate_by_motion(form, values, motion)
        moving += over_x * motion.dx + over_v * motion.dv
        rows = differentiate_by_parameters(partial(form.function, motion.x, motion.v), values, form.parameters)
        own += [(at + k, np.broadcast_to(row, len(motion.x))) for k, row in enumerate(rows)]
    for at, form, values in setting.select_forms("hysteretic_force", "relaxation_force"):
        moving += np.stack(
            [
                _differentiate_memory_force(form, h, values, motion, dx, dv)
                for dx, dv in zip(motion.dx, motion.dv, strict=True)
            ]
        )
        whole = partial(_compute_memory_force, form, h, motion.x, motion.v)
        own += [(at + k, row) for k, row in enumerate(differentiate_by_parameters(whole, values, form.parameters))]
    return moving, own


def _differentiate_memory_force(
    form: Form, h: float, values: tuple[float, ...], motion: DamperMotion, dx: Array, dv: Array
) -> Array:
    """(N,) slope of a force that remembers the way, over an unknown that moves the motion by dx and dv."""
    step = _DISPLACEMENT_STEP / max(float(np.abs(dx).max()), 1e-9)
    ahead, back = (
        _compute_memory_force(form, h, motion.x + s * dx, motion.v + s * dv, *values) for s in (step, -step)
    )
    return np.asarray((ahead - back) / (2.0 * step))


def _differentiate_by_motion(form: Form, values: tuple[float, ...], motion: DamperMotion) -> tuple[Array, Array]:
    over_x = differentiate_by_argument(lambda x: form.function(x, motion.v, *values), motion.x, _DISPLACEMENT_STEP)
    over_v = differentiate_by_argument(lambda v: form.function(motion.x, v, *values), motion.v, _VELOCITY_STEP)
    return over_x, over_v


def apply_force_channel(
    setting: SimulationModel,
    stroke: Excitation,
    motion: DamperMotion,
    force: Array,
    J: Array | None,
    first: int,
    delays: list[int],
) -> Array:
    """The force as the channel sees it; its sensitivities are moved along in place.

    Args:
        setting, stroke, motion: as in the trajectory.
        force: (N,) of the damper on its mounting [N].
        J: (N, U) its sensitivities; None where they are not asked for.
        first: column of the effects' first parameter.
        delays: columns that the delay of the motion moves.

    Returns:
        (N,) [N].
    """
    # In the order of the chain: the channel's lag comes last and holds back all that was added before it.
    for at, form, values in setting.select_forms("inertia"):
        force = force + form.function(motion.a, *values)
        if J is not None:
            _add_columns(J, first + at, partial(form.function, motion.a), form, values)
            steepness = _differentiate_inertia(form, values, motion)
            J[:, delays] += (steepness * motion.da)[:, None]
            for early, _, _ in setting.select_forms("displacement_shift"):
                # A displacement that is late is a force that is early.
                J[:, first + early] -= steepness * motion.da
    for at, form, values in setting.select_forms("additive_force"):
        force = force + form.function(stroke.time, stroke.sampled_drive, *values)
        if J is not None:
            _add_columns(J, first + at, partial(form.function, stroke.time, stroke.sampled_drive), form, values)
    for at, _, values in setting.select_forms("force_lag"):
        force = _apply_lag_to_both(force, values[0], 1.0 / stroke.rate, J, first + at)
    return force


def _differentiate_inertia(form: Form, values: tuple[float, ...], motion: DamperMotion) -> Array:
    return np.asarray(differentiate_by_argument(lambda a: form.function(a, *values), motion.a, _ACCELERATION_STEP))


def _add_columns(J: Array, at: int, function: Any, form: Form, values: tuple[float, ...]) -> None:
    for k, row in enumerate(differentiate_by_parameters(function, values, form.parameters)):
        J[:, at + k] += row


def _apply_lag_to_both(force: Array, lag: float, h: float, J: Array | None, at: int) -> Array:
    """The force behind a first-order lag; sensitivities J are lagged in place."""
    found = apply_lag(force, lag, h)
    if J is not None:
        J[:] = apply_lag(J, lag, h)
        # No channel is early: at a lag of zero the difference is one-sided.
        lower = max(lag - _LAG_STEP, 0.0)
        J[:, at] = (apply_lag(force, lag + _LAG_STEP, h) - apply_lag(force, lower, h)) / (lag + _LAG_STEP - lower)
    return found

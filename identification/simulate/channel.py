"""Path from the law's force to the recorded force: parallel forces, inertia and the force channel."""

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
"""Steps of differences of parallel forces [m], [m/s]."""
_ACCELERATION_STEP = 1e-3
"""Step of differences of inertia [m/s^2]."""
_LAG_STEP = 1e-7
"""Step of differences of the channel's lag [s]."""
_DEADBAND = 1e-6
"""Half width of the deadband of a seal's displacement [m]; without it, noise at rest would erase the memory."""


def compute_parallel_force(model: SimulationModel, motion: DamperMotion, h: float) -> Array:
    """Compute the sum of all parallel forces (N,) [N]; samples are h [s] apart."""
    total = np.zeros(len(motion.x))
    for _, form, values in model.select_forms("parallel_force"):
        total += form.function(motion.x, motion.v, *values)
    for _, form, values in model.select_forms("hysteretic_force", "relaxation_force"):
        total += _compute_memory_force(form, h, motion.x, motion.v, *values)
    return total


def _compute_memory_force(form: Form, h: float, x: Array, v: Array, *values: float) -> Array:
    """Compute the parallel force (N,) [N] of a form with memory or relaxation."""
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
    """Return the displacement (N,) [m] that follows x only where x leaves a band of ``still`` to either side."""
    found = np.empty(len(x))
    held = x[0]
    for i in range(len(x)):
        held = min(max(held, x[i] - still), x[i] + still)
        found[i] = held
    return found


def differentiate_parallel_force(
    model: SimulationModel, motion: DamperMotion, h: float
) -> tuple[Array, list[tuple[int, Array]]]:
    """Differentiate the parallel forces over the unknowns of the motion (M, N), and over parameters by column."""
    moving, own = np.zeros_like(motion.dx), []
    for at, form, values in model.select_forms("parallel_force"):
        over_x, over_v = _differentiate_by_motion(form, values, motion)
        moving += over_x * motion.dx + over_v * motion.dv
        rows = differentiate_by_parameters(partial(form.function, motion.x, motion.v), values, form.parameters)
        own += [(at + k, np.broadcast_to(row, len(motion.x))) for k, row in enumerate(rows)]
    for at, form, values in model.select_forms("hysteretic_force", "relaxation_force"):
        pairs = zip(motion.dx, motion.dv, strict=True)
        moving += np.stack([_differentiate_memory_force(form, h, values, motion, *pair) for pair in pairs])
        whole = partial(_compute_memory_force, form, h, motion.x, motion.v)
        own += [(at + k, row) for k, row in enumerate(differentiate_by_parameters(whole, values, form.parameters))]
    return moving, own


def _differentiate_memory_force(
    form: Form, h: float, values: tuple[float, ...], motion: DamperMotion, dx: Array, dv: Array
) -> Array:
    """Differentiate a force with memory over an unknown with derivatives dx, dv (N,) of the motion."""
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
    model: SimulationModel,
    excitation: Excitation,
    motion: DamperMotion,
    force: Array,
    J: Array | None,
    first: int,
    delays: list[int],
) -> Array:
    """Apply inertia and the force channel to a force; its sensitivities are transformed in place.

    Args:
        model, excitation, motion: as in the simulation.
        force: (N,) force of the damper on its mounting [N].
        J: (N, U) sensitivities of the force, or None.
        first: column of the first parameter of the effects.
        delays: columns of the unknowns that delay the motion.

    Returns:
        (N,) recorded force [N].
    """
    # In the order of the chain: the channel's lag comes last and acts on all forces added before it.
    for at, form, values in model.select_forms("inertia"):
        force = force + form.function(motion.a, *values)
        if J is not None:
            _add_columns(J, first + at, partial(form.function, motion.a), form, values)
            steepness = _differentiate_inertia(form, values, motion)
            J[:, delays] += (steepness * motion.da)[:, None]
            for early, _, _ in model.select_forms("displacement_shift"):
                # A delay of the displacement acts as a negative delay of the force.
                J[:, first + early] -= steepness * motion.da
    for at, form, values in model.select_forms("additive_force"):
        force = force + form.function(excitation.time, excitation.sampled_drive, *values)
        if J is not None:
            _add_columns(
                J, first + at, partial(form.function, excitation.time, excitation.sampled_drive), form, values
            )
    for at, _, values in model.select_forms("force_lag"):
        force = _apply_lag_to_both(force, values[0], 1.0 / excitation.rate, J, first + at)
    return force


def _differentiate_inertia(form: Form, values: tuple[float, ...], motion: DamperMotion) -> Array:
    return np.asarray(differentiate_by_argument(lambda a: form.function(a, *values), motion.a, _ACCELERATION_STEP))


def _add_columns(J: Array, at: int, function: Any, form: Form, values: tuple[float, ...]) -> None:
    for k, row in enumerate(differentiate_by_parameters(function, values, form.parameters)):
        J[:, at + k] += row


def _apply_lag_to_both(force: Array, lag: float, h: float, J: Array | None, at: int) -> Array:
    """Return the force after a first-order lag; the sensitivities J are lagged in place."""
    found = apply_lag(force, lag, h)
    if J is not None:
        J[:] = apply_lag(J, lag, h)
        # A lag cannot be negative, so the difference is one-sided at zero.
        lower = max(lag - _LAG_STEP, 0.0)
        J[:, at] = (apply_lag(force, lag + _LAG_STEP, h) - apply_lag(force, lower, h)) / (lag + _LAG_STEP - lower)
    return found

"""Path from the law's force to the recorded force: parallel forces, inertia and the force channel."""

from collections.abc import Callable, Iterable
from functools import partial

import numpy as np

from identification.arrays import Array
from identification.damper.effects import Form, step_response
from identification.simulate.curves import apply_lag, differentiate_by_argument, differentiate_by_parameters
from identification.simulate.dual import differentiate
from identification.simulate.memories import trace_path_memory
from identification.simulate.motion import DamperMotion, compile_once
from identification.simulate.simulation_model import Excitation, SimulationModel
from identification.simulate.variables import DamperVariables, apply_deadband

_DISPLACEMENT_STEP = 1e-8
"""Step of differences of parallel forces with memory [m]."""
_FORCE_STEP = 1e-6
"""Step of differences of a force channel, relative to the largest force [1]."""
_LAG_STEP = 1e-7
"""Step of differences of the channel's lag [s]."""
_PRESLIDING_DEADBAND = 0.005
"""Half width of the deadband of the displacement over the presliding distance [1].

Noise at rest would otherwise add up to a path that releases the deflected lip. A width in metres would hide the
presliding of a small damper.
"""


def compute_parallel_force(model: SimulationModel, excitation: Excitation, motion: DamperMotion) -> Array:
    """Compute the sum of all parallel forces (N,) [N]."""
    total, h = np.zeros(len(motion.x)), 1.0 / excitation.rate
    for _, form, values in model.select_forms("parallel_force"):
        total += form.function(motion.x, motion.v, *values)
    for _, form, values in model.select_forms("hysteretic_force", "relaxation_force"):
        total += _compute_memory_force(form, h, motion.x, motion.v, *values)
    for _, form, values in model.select_forms("force_function", "mount_function"):
        total += form.function(DamperVariables(excitation, motion.x, motion.v, motion.a), *values)
    return total


def _compute_memory_force(form: Form, h: float, x: Array, v: Array, *values: float) -> Array:
    """Compute the parallel force (N,) [N] of a form with memory or relaxation."""
    named = form.name_values(values)
    if form.action == "relaxation_force":
        return np.asarray(form.function(x, v, apply_lag(x, named["exchange_time"], h), *values))
    path = apply_deadband(x, _PRESLIDING_DEADBAND * named["presliding_distance"])
    memory = trace_path_memory(compile_once(form.memory), path, v, *values)
    return np.asarray(form.function(x, v, memory, *values))


def differentiate_parallel_force(
    model: SimulationModel, excitation: Excitation, motion: DamperMotion
) -> tuple[Array, list[tuple[int, Array]]]:
    """Differentiate the parallel forces over the unknowns of the motion (M, N), and over parameters by column."""
    moving, own, h = np.zeros_like(motion.dx), [], 1.0 / excitation.rate
    for at, form, values in model.select_forms("parallel_force"):
        _, (over_x, over_v, *rows) = differentiate(form.function, (motion.x, motion.v, *values))
        moving += over_x * motion.dx + over_v * motion.dv
        own += [(at + k, row) for k, row in enumerate(rows)]
    for at, form, values in model.select_forms("hysteretic_force", "relaxation_force"):
        pairs = zip(motion.dx, motion.dv, strict=True)
        at_motion = partial(_evaluate_memory_force, form, h, values)
        moving += np.stack([_differentiate_by_unknown(at_motion, motion, *pair) for pair in pairs])
        whole = partial(_compute_memory_force, form, h, motion.x, motion.v)
        own += [(at + k, row) for k, row in enumerate(differentiate_by_parameters(whole, values, form.parameters))]
    for at, form, values in model.select_forms("force_function", "mount_function"):
        variables = DamperVariables(excitation, motion.x, motion.v, motion.a)
        moving += _differentiate_defined_force(
            form, excitation, values, motion, _differentiate_acceleration(model, motion)
        )
        _, rows = differentiate(partial(form.function, variables), values)
        own += [(at + k, row) for k, row in enumerate(rows)]
    return moving, own


def _evaluate_memory_force(form: Form, h: float, values: tuple[float, ...], x: Array, v: Array) -> Array:
    return _compute_memory_force(form, h, x, v, *values)


def _differentiate_defined_force(
    form: Form, excitation: Excitation, values: tuple[float, ...], motion: DamperMotion, da: Array
) -> Array:
    """Differentiate the force of a defined effect over the unknowns of the motion, (M, N)."""
    rows = []
    for over_x, over_v, over_a in zip(motion.dx, motion.dv, da, strict=True):
        step = _DISPLACEMENT_STEP / max(float(np.abs(over_x).max()), 1e-9)
        ahead, back = (
            form.function(
                DamperVariables(excitation, motion.x + s * over_x, motion.v + s * over_v, motion.a + s * over_a),
                *values,
            )
            for s in (step, -step)
        )
        rows.append((ahead - back) / (2.0 * step))
    return np.stack(rows)


def _differentiate_acceleration(model: SimulationModel, motion: DamperMotion) -> Array:
    """Return the derivatives (M, N) of the acceleration: a delay of the displacement is a negative delay."""
    da = np.zeros_like(motion.dx)
    da[0] = motion.da
    for at, _, _ in model.select_forms("displacement_shift"):
        da[1 + motion.columns.index(at)] = -motion.da
    return da


def _differentiate_by_unknown(
    at_motion: Callable[[Array, Array], Array], motion: DamperMotion, dx: Array, dv: Array
) -> Array:
    """Differentiate a force (N,) over an unknown with derivatives dx, dv (N,) of the motion."""
    step = _DISPLACEMENT_STEP / max(float(np.abs(dx).max()), 1e-9)
    ahead, back = (at_motion(motion.x + s * dx, motion.v + s * dv) for s in (step, -step))
    return np.asarray((ahead - back) / (2.0 * step))


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
            _, (over_a, *rows) = differentiate(form.function, (motion.a, *values))
            _add_columns(J, first + at, rows)
            J[:, delays] += (over_a * motion.da)[:, None]
            for early, _, _ in model.select_forms("displacement_shift"):
                # A delay of the displacement acts as a negative delay of the force.
                J[:, first + early] -= over_a * motion.da
    for at, form, values in model.select_forms("additive_force"):
        added = partial(form.function, excitation.time, excitation.sampled_drive)
        force = force + added(*values)
        if J is not None:
            _add_columns(J, first + at, differentiate(added, values)[1])
    for at, form, values in model.select_forms("channel_function"):
        force = _apply_channel_function(excitation, force, J, form, values, first + at)
    for at, form, values in model.select_forms("channel_response"):
        force = _apply_channel_response(excitation, force, J, form, values, first + at)
    for at, _, values in model.select_forms("force_lag"):
        force = _apply_lag_to_both(force, values[0], 1.0 / excitation.rate, J, first + at)
    return force


def _add_columns(J: Array, at: int, rows: Iterable[Array]) -> None:
    for k, row in enumerate(rows):
        J[:, at + k] += row


def _apply_channel_function(
    excitation: Excitation, force: Array, J: Array | None, form: Form, values: tuple[float, ...], at: int
) -> Array:
    """Return the force with the value of a defined effect added; the sensitivities J follow in place."""
    variables = {"force": force, "drive": excitation.sampled_drive, "time": excitation.time}

    def at_force(recorded: Array) -> Array:
        return np.asarray(form.function({**variables, "force": recorded}, *values))

    if J is not None:
        step = _FORCE_STEP * max(float(np.abs(force).max()), 1.0)
        J *= (1.0 + differentiate_by_argument(at_force, force, step))[:, None]
        _add_columns(J, at, differentiate(partial(form.function, variables), values)[1])
    return np.asarray(force + at_force(force))


def _apply_channel_response(
    excitation: Excitation, force: Array, J: Array | None, form: Form, values: tuple[float, ...], at: int
) -> Array:
    """Return the force after the step response of a defined effect; the sensitivities J follow in place."""
    h = 1.0 / excitation.rate
    weights = step_response.compute_weights(form.function, values, h)
    found = step_response.apply_weights(weights, force)
    if J is not None:
        J[:] = step_response.apply_weights(weights, J)

        def respond(*parameters: float) -> Array:
            changed = step_response.compute_weights(form.function, parameters, h)
            return step_response.apply_weights(changed, force)

        _add_columns(J, at, differentiate_by_parameters(respond, values, form.parameters))
    return found


def _apply_lag_to_both(force: Array, lag: float, h: float, J: Array | None, at: int) -> Array:
    """Return the force after a first-order lag; the sensitivities J are lagged in place."""
    found = apply_lag(force, lag, h)
    if J is not None:
        J[:] = apply_lag(J, lag, h)
        # A lag cannot be negative, so the difference is one-sided at zero.
        lower = max(lag - _LAG_STEP, 0.0)
        J[:, at] = (apply_lag(force, lag + _LAG_STEP, h) - apply_lag(force, lower, h)) / (lag + _LAG_STEP - lower)
    return found

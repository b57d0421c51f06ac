"""Integrator of actuator and specimen: explicit Runge-Kutta of fourth order, with steps bound by the stiffness.

It is deliberately different from the implicit integrator of identification. Each command sample is divided into
substeps of at most an eighth of a millisecond, each substep into equal integration steps. At a reversal the
hysteretic variable relaxes at about 2e4 1/s, and the law has a corner where the slip velocity changes sign.
Substeps near a reversal are therefore divided into more steps.
"""

import functools
import math
from collections.abc import Callable

import numba
import numpy as np

from sim_rig.plant.defined_effects import (
    DEFINED_TYPE,
    DRIVE_PLACE,
    DefinedFunctions,
    evaluate,
    hold_drive,
    respond_to_drive,
    update_memory,
)
from sim_rig.plant.derivatives import compute_rates
from sim_rig.plant.jit import (
    BINARY_TYPE,
    QUATERNARY_TYPE,
    SCALE_TYPE,
    TERNARY_TYPE,
    Array,
    BinaryFunction,
    QuaternaryFunction,
    ScaleFunction,
    TernaryFunction,
    compile_function,
)
from sim_rig.plant.states import (
    COOLING_RATE,
    DAMPER,
    DEAD_TIME,
    ENERGY,
    FIELD,
    FIELD_MEMORY,
    FIXTURE_COMPLIANCE,
    OUTPUT,
    POSITION,
    STATE_COUNT,
    VELOCITY,
    Z,
)
from sim_rig.plant.step_counts import count_steps

MAX_STEPS = 2e5
"""Threshold on the steps of a substep: above it, the motion counts as divergent."""
_OUTPUT_TOLERANCE = 1e-7
"""Relative deviation from the drive [1] within which the amplifier's output is settled and needs no fine steps."""


@compile_function
def _integrate_step(
    s: Array,
    last_damper: float,
    iron: Array,
    start: float,
    end: float,
    drive: float,
    delayed_output: float,
    h: float,
    k: Array,
    p: Array,
    backlash_map: BinaryFunction,
    parallel_force: QuaternaryFunction,
    field_map: BinaryFunction,
    field_memory: TernaryFunction,
    scale_factors: ScaleFunction,
    defined: DefinedFunctions | None,
    time: float,
    work: Array,
) -> float:
    """Take one classical Runge-Kutta step of h [s] at a time [s]; the command is linear from start to end [m].

    States and memories of the iron are changed in place.

    Returns:
        Displacement of the damper [m].
    """
    a, b, c, d, mid = work[0], work[1], work[2], work[3], work[4]
    remanence = iron.mean()
    half, field, energy = 0.5 * (start + end), s[FIELD], s[ENERGY]
    compute_rates(
        s,
        last_damper,
        remanence,
        start,
        drive,
        delayed_output,
        k,
        p,
        backlash_map,
        parallel_force,
        field_map,
        scale_factors,
        a,
        defined,
        time,
    )
    for j in range(STATE_COUNT):
        mid[j] = s[j] + 0.5 * h * a[j]
    compute_rates(
        mid,
        last_damper,
        remanence,
        half,
        drive,
        delayed_output,
        k,
        p,
        backlash_map,
        parallel_force,
        field_map,
        scale_factors,
        b,
        defined,
        time + 0.5 * h,
    )
    for j in range(STATE_COUNT):
        mid[j] = s[j] + 0.5 * h * b[j]
    compute_rates(
        mid,
        last_damper,
        remanence,
        half,
        drive,
        delayed_output,
        k,
        p,
        backlash_map,
        parallel_force,
        field_map,
        scale_factors,
        c,
        defined,
        time + 0.5 * h,
    )
    for j in range(STATE_COUNT):
        mid[j] = s[j] + h * c[j]
    compute_rates(
        mid,
        last_damper,
        remanence,
        end,
        drive,
        delayed_output,
        k,
        p,
        backlash_map,
        parallel_force,
        field_map,
        scale_factors,
        d,
        defined,
        time + h,
    )
    for j in range(STATE_COUNT):
        s[j] += h / 6.0 * (a[j] + 2.0 * (b[j] + c[j]) + d[j])
    # Once per step, from its end: stages are trial points that must not enter the memory of clevis and iron.
    if k[FIELD_MEMORY] != 0.0 and s[FIELD] != field:
        for m in range(len(iron)):
            iron[m] = field_memory(iron[m], s[FIELD] - field, (m + 0.5) / len(iron))
    last_damper = float(backlash_map(last_damper, s[POSITION]))
    if defined is not None:
        x = s[DAMPER] if k[FIXTURE_COMPLIANCE] > 0.0 else last_damper
        lost_energy = k[COOLING_RATE] * h * 0.5 * (energy + s[ENERGY])
        update_memory(defined, x, field_map(s[FIELD], iron.mean()), lost_energy, time + h)
    return last_damper


@compile_function
def _interpolate_output(output_history: Array, substep: int, delay: float) -> float:
    """Return the amplifier output that reaches the coil half way through a substep, after ``delay`` [substeps]."""
    position = max(substep + 0.5 - delay, 0.0)
    i = min(int(position), substep)
    t = min(position - i, 1.0) if i < substep else 0.0
    before, after = (
        output_history[i % len(output_history)],
        output_history[min(i + 1, substep) % len(output_history)],
    )
    return float(before + t * (after - before))


def _integrate(
    s: Array,
    last_damper: float,
    iron: Array,
    output_history: Array,
    first_substep: int,
    command: Array,
    drive: Array,
    h: float,
    substeps: int,
    k: Array,
    p: Array,
    backlash_map: BinaryFunction,
    parallel_force: QuaternaryFunction,
    field_map: BinaryFunction,
    field_memory: TernaryFunction,
    scale_factors: ScaleFunction,
    defined: DefinedFunctions | None,
    positions: Array,
    velocities: Array,
    forces: Array,
    outputs: Array,
    damper: Array,
    states: Array,
) -> tuple[float, int]:
    """Integrate the states through M command samples, in place.

    Args:
        s: (STATE_COUNT,) states at the first instant.
        last_damper: [m] displacement of the damper.
        iron: (C,) memories of the iron, changed in place.
        output_history: ring buffer of the amplifier's output at the start of each substep, at least as long as
            the dead time.
        first_substep: substeps integrated so far.
        command: (M+1,) commanded displacement [m] at the start of each sample and the end of the last.
        drive: (M,) commanded drive [V or A], held through each sample.
        h: [s] one substep; ``substeps`` of them make a sample.
        k, p, backlash_map, parallel_force, field_map, scale_factors: as in ``compute_rates``.
        field_memory: memory over (last memory, change of the field, position among all memories in 0..1).
        defined: functions of defined effects, with their memory; None without such effects.
        positions, velocities, forces: (M substeps,) filled with position [m] and velocity [m/s] of the actuator
            and force on the load cell [N], at the start of each substep.
        outputs: (M,) filled with the amplifier's output half way through each sample.
        damper: (M, 2) filled with displacement [m] and velocity [m/s] of the damper at each sample.
        states: (M, STATE_COUNT) filled with the states at each sample.

    Returns:
        Displacement of the damper [m], and the sample in which the motion diverged, or M.
    """
    work, rate = np.empty((5, STATE_COUNT)), np.empty(STATE_COUNT)
    for i in range(len(drive)):
        states[i] = s
        for j in range(substeps):
            start = command[i] + (command[i + 1] - command[i]) * j / substeps
            end = command[i] + (command[i + 1] - command[i]) * (j + 1) / substeps
            if abs(drive[i] - s[OUTPUT]) < _OUTPUT_TOLERANCE * (abs(drive[i]) + 1e-3):
                s[OUTPUT] = drive[i]
            substep = first_substep + i * substeps + j
            time = substep * h
            output_history[substep % len(output_history)] = s[OUTPUT]
            if defined is not None:
                # Before the new drive, which the output has not followed yet.
                output = s[OUTPUT] + evaluate(defined, DRIVE_PLACE)
                output_history[substep % len(output_history)] = respond_to_drive(defined, output, substep)
                hold_drive(defined, drive[i])
            delayed_output = _interpolate_output(output_history, substep, k[DEAD_TIME] / h)
            force, x, v, slip = compute_rates(
                s,
                last_damper,
                iron.mean(),
                start,
                drive[i],
                delayed_output,
                k,
                p,
                backlash_map,
                parallel_force,
                field_map,
                scale_factors,
                rate,
                defined,
                time,
            )
            positions[i * substeps + j], velocities[i * substeps + j] = s[POSITION], s[VELOCITY]
            forces[i * substeps + j] = force
            if j == 0:
                damper[i, 0], damper[i, 1] = x, v
            if j == substeps // 2:
                outputs[i] = s[OUTPUT]
            steps = count_steps(s, rate, x, slip, drive[i], h, k, p, backlash_map)
            if not (steps <= MAX_STEPS and math.isfinite(force) and math.isfinite(s[Z])):
                return last_damper, i
            for step in range(int(steps)):
                step_start = start + (end - start) * step / steps
                step_end = start + (end - start) * (step + 1) / steps
                last_damper = _integrate_step(
                    s, last_damper, iron, step_start, step_end, drive[i], delayed_output, h / steps, k, p,
                    backlash_map, parallel_force, field_map, field_memory, scale_factors,
                    defined, time + h * step / steps, work,
                )  # fmt: skip
    return last_damper, len(drive)


_VECTOR, _MATRIX, _SCALAR = numba.float64[::1], numba.float64[:, ::1], numba.float64
_INPUTS = (
    *(_VECTOR, _SCALAR, _VECTOR, _VECTOR, numba.int64, _VECTOR, _VECTOR, _SCALAR, numba.int64, _VECTOR, _VECTOR),
    *(BINARY_TYPE, QUATERNARY_TYPE, BINARY_TYPE, TERNARY_TYPE, SCALE_TYPE),
)
_RESULTS = (_VECTOR, _VECTOR, _VECTOR, _VECTOR, _MATRIX, _MATRIX)
integrate = compile_function(_integrate, (*_INPUTS, numba.types.none, *_RESULTS))
"""`_integrate`, compiled at the first import, once for all kinds of effects of the library."""


def choose_integrator(defined: DefinedFunctions | None) -> Callable[..., tuple[float, int]]:
    """Return the compiled `_integrate`: without defined effects, it contains none of their code."""
    return integrate if defined is None else _compile_with_defined_effects()


@functools.cache
def _compile_with_defined_effects() -> Callable[..., tuple[float, int]]:
    return compile_function(_integrate, (*_INPUTS, DEFINED_TYPE, *_RESULTS))

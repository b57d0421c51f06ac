"""Plant: the simulated specimen on its actuator, before any sensor.

Chain: commands -> actuator (lag, servo, droop) -> load cell -> mounting -> damper (law and parallel forces).
Time is an argument. A plant advances sample by sample on the wires, or through a whole record at once, by the same
compiled steps.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from identification.damper.effects import compute_elongation, connection
from sim_rig.errors import PlantError
from sim_rig.plant import integrator, states
from sim_rig.plant.constants import make_plant_constants
from sim_rig.plant.defined_effects import (
    DRIVE_PLACE,
    FORCE_PLACE,
    MOUNTING_PLACE,
    evaluate,
    make_defined_functions,
    set_drive_response,
    start_variables,
)
from sim_rig.plant.effects import EffectFunctions
from sim_rig.plant.jit import BINARY_TYPE, QUATERNARY_TYPE, SCALE_TYPE, TERNARY_TYPE, Array, FixedAddress
from sim_rig.scenario import Scenario

_MAX_SUBSTEP = 1.25e-4
"""[s] longest substep: the true signals need this resolution for the sensors' filters."""
_MIN_SUBSTEP = 2.5e-5
"""[s] substep at the fastest sampling that the rig plays; it bounds the memory for the coil's dead time."""


class TrueSignals(NamedTuple):
    """True signals during M command samples, each divided into B substeps."""

    position: Array
    """(M B,) of the actuator [m], at the start of each substep."""
    velocity: Array
    """(M B,) of the actuator [m/s], at the start of each substep."""
    force: Array
    """(M B,) on the load cell [N], at the start of each substep."""
    output: Array
    """(M,) of the amplifier [V or A], half way through each sample, where it has settled."""
    damper_displacement: Array
    """(M,) behind the mounting [m]."""
    damper_velocity: Array
    """(M,) [m/s]"""
    y: Array
    """(M,) inner displacement [m]."""
    z: Array
    """(M,) hysteretic displacement [m]."""
    field: Array
    """(M,) behind the drive [V or A]."""
    temperature: Array
    """(M,) of the damper [degC]."""


class Plant:
    """One specimen on its actuator, advanced by ``advance`` or ``simulate``.

    It starts settled: at rest at its first commanded position, with a relaxed loop and the field at its drive.
    """

    def __init__(self, scenario: Scenario, displacement: float = 0.0, drive: float = 0.0) -> None:
        """Settle the specimen of a scenario at a displacement [m] and a drive [V or A].

        Raises:
            PlantError: the effects have no finite force there.
        """
        effects = self._effects = EffectFunctions(scenario)
        self._response_step = 0.0
        self._law = np.array(scenario.parameters)
        self._parallel_force = FixedAddress(effects.make_parallel_force(), QUATERNARY_TYPE)
        self._follower = FixedAddress(effects.make_backlash_map(), BINARY_TYPE)
        self._scale_factors = FixedAddress(effects.make_scale_factors(), SCALE_TYPE)
        self._field_map = FixedAddress(effects.make_field_map(), BINARY_TYPE)
        self._field_memory = FixedAddress(effects.make_field_memory(), TERNARY_TYPE)
        self._defined = make_defined_functions(effects)
        # Here and not at the first sample, because the first compilation takes seconds.
        self._integrate = integrator.choose_integrator(self._defined)
        self._constants = make_plant_constants(scenario, self._law, effects, self._defined)
        self._command = displacement
        self._states, self._damper_position = self._find_equilibrium(displacement, drive)
        self._substeps = self._samples = 0
        # The substep is not known yet, so the memory is long enough for the finest.
        dead_substeps = self._constants[states.DEAD_TIME] / _MIN_SUBSTEP
        self._output_history = np.full(math.ceil(dead_substeps) + 3, self._states[states.FIELD])

    def advance(self, dt: float, displacement: float, drive: float) -> TrueSignals:
        """Advance by dt [s]: the command goes linearly to ``displacement`` [m], the drive [V or A] is held.

        Raises:
            PlantError: the motion is not finite.
        """
        return self.simulate(dt, np.array([self._command, displacement]), np.array([drive]))

    def simulate(self, dt: float, command: Array, drive: Array) -> TrueSignals:
        """Advance through M samples of dt [s].

        Args:
            dt: [s] one sample.
            command: (M+1,) commanded displacement [m] at the start of each sample and at the end of the last.
            drive: (M,) commanded drive [V or A], held through each sample.

        Raises:
            PlantError: the motion is not finite.
        """
        count, substeps = len(drive), count_substeps(dt)
        self._start_drive_response(dt / substeps)
        (position, velocity, force), output = np.empty((3, count * substeps)), np.empty(count)
        damper, record = np.empty((count, 2)), np.empty((count, states.STATE_COUNT))
        self._damper_position, done = self._integrate(
            self._states, self._damper_position, self._iron, self._output_history, self._substeps,
            np.ascontiguousarray(command, float), np.ascontiguousarray(drive, float),
            dt / substeps, substeps, self._constants, self._law,
            self._follower, self._parallel_force, self._field_map, self._field_memory, self._scale_factors,
            self._defined, position, velocity, force, output, damper, record,
        )  # fmt: skip
        self._substeps += count * substeps
        if done < count:
            raise PlantError(
                f"the specimen runs away {(self._samples + done) * dt:.3f} s into its motion, at "
                f"{record[done, states.POSITION]:.4g} m: no finite force; check the damper and the stroke"
            )
        self._command, self._samples = float(command[-1]), self._samples + count
        return TrueSignals(
            position,
            velocity,
            force,
            output,
            damper[:, 0],
            damper[:, 1],
            record[:, states.Y],
            record[:, states.Z],
            record[:, states.FIELD],
            record[:, states.TEMPERATURE],
        )

    def _start_drive_response(self, h: float) -> None:
        """Start the step response of the drive settled, unless it has started with substeps of h [s]."""
        if self._defined is None or h == self._response_step:
            return
        weights = self._effects.compute_response_weights("drive_response", h)
        drive = float(self._states[states.OUTPUT]) + evaluate(self._defined, DRIVE_PLACE)
        self._defined, self._response_step = set_drive_response(self._defined, weights, drive), h

    def _find_equilibrium(self, displacement: float, drive: float) -> tuple[Array, float]:
        """Return the states at rest under the load of the resting damper, and its displacement [m]."""
        position = displacement
        # The droop changes the load only slightly: each iteration reduces the error by a factor above one hundred.
        for _ in range(3):
            load, mounting_force = self._compute_resting_forces(position, drive)
            position = displacement - self._constants[states.ACTUATOR_COMPLIANCE] * (load + mounting_force)
        if not math.isfinite(position):
            raise PlantError(f"the specimen has no finite force at rest at {displacement:.4g} m")
        damper = position - self._compute_elongation(load)
        state = np.zeros(states.STATE_COUNT)
        state[[states.COMMAND, states.POSITION, states.Y]] = displacement, position, damper
        state[[states.DAMPER, states.GAS_POSITION]] = damper
        field = self._start_coil(damper, drive)
        state[[states.FIELD, states.LAGGED, states.LAGGED_TWICE, states.OUTPUT]] = field, field, field, drive
        state[states.TEMPERATURE] = self._constants[states.AMBIENT]
        return state, position

    def _compute_elongation(self, load: float) -> float:
        """Return the elongation of the mounting [m] at rest under a load [N]."""
        k = self._constants
        if len(k) > states.CONSTANT_COUNT:
            return float(np.interp(load, connection.FORCES, k[states.CONSTANT_COUNT :]))
        spring = k[[states.FIXTURE_COMPLIANCE, states.GAP, states.HARDENING, states.IN_GAP_STIFFNESS]]
        return float(compute_elongation(load, *spring)) if spring[0] > 0.0 else 0.0

    def _compute_resting_forces(self, position: float, drive: float) -> tuple[float, float]:
        """Return the forces of damper and defined effects in the mounting [N], at rest at a position [m]."""
        force = self._law[11] * (position - self._law[13]) + self._parallel_force(position, 0.0, 0.0, position)
        if self._defined is None:
            return force, 0.0
        start_variables(self._defined, position, drive, drive)
        return force + evaluate(self._defined, FORCE_PLACE), evaluate(self._defined, MOUNTING_PLACE)

    def _start_coil(self, damper: float, drive: float) -> float:
        """Start the memories of iron and defined effects at rest; return the settled field [V or A]."""
        if self._defined is None:
            self._magnetise(drive)
            return drive
        start_variables(self._defined, damper, drive, drive)
        field = drive + evaluate(self._defined, DRIVE_PLACE)
        self._magnetise(field)
        start_variables(self._defined, damper, drive, self._field_map(field, self._iron.mean()))
        return field

    def _magnetise(self, field: float) -> None:
        """Set the memories of the iron to those after the change to the first field [V or A]."""
        count, change = self._effects.count_field_memories(), self._effects.get_initial_rise() * field
        self._iron = np.array([self._field_memory(0.0, change, (m + 0.5) / count) for m in range(count)])


def count_substeps(dt: float) -> int:
    """Return the number of substeps of a sample of dt [s]: even, each at most an eighth of a millisecond."""
    # Even, because the amplifier's output is read half way through a sample.
    return max(2 * math.ceil(dt / _MAX_SUBSTEP / 2 - 1e-9), 2)


def apply_start_ramp(scenario: Scenario, time: Array, displacement: Array) -> Array:
    """Return the command with the actuator's start ramp: the motion fades in from its first position.

    Args:
        scenario: its actuator defines the length of the ramp.
        time: (N,) since the start [s].
        displacement: (N,) [m].
    """
    if scenario.actuator.start_ramp == 0:
        return displacement
    t = np.clip((time - time[0]) / scenario.actuator.start_ramp, 0.0, 1.0)
    fade = t**3 * (10 - 15 * t + 6 * t * t)
    return np.asarray(displacement[0] + (displacement - displacement[0]) * fade)


def split_into_chunks(count: int, size: int) -> Iterator[slice]:
    """Return slices that divide ``count`` samples into chunks of ``size``."""
    return (slice(start, min(start + size, count)) for start in range(0, count, size))

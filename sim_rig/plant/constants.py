"""Constants of the plant, computed from a scenario."""

import math

import numpy as np

from identification.damper.effects import connection
from sim_rig.plant import states
from sim_rig.plant.defined_effects import DefinedFunctions, compute_steepest_slope
from sim_rig.plant.effects import EffectFunctions
from sim_rig.plant.jit import Array, QuaternaryFunction
from sim_rig.scenario import Scenario

_MIN_LAG = 2e-5
"""Threshold on the second lag of the coil [s]: below it, the lag is omitted."""
_LEAST_LAG = 5e-6
"""Lag of the damper behind the stiffest part of a tabulated mounting [s]: a stiffer one would need finer steps."""
_SMALLEST_DAMPING = 1e-3
"""Smallest damping for which this lag is kept [N s/m]."""
_MAX_LIP_SPEED = 0.5
"""[m/s] largest velocity for which the deflection of a lip is integrated stably."""


def make_rig_constants(scenario: Scenario, law: Array) -> Array:
    """Return the constants of actuator, amplifier, heat and hysteresis, `COMMAND_LAG` to `Z_SATURATION`, (10,).

    Args:
        scenario: actuator, amplifier and thermal section are used.
        law: (14,) parameters of the damper in the paper's order.
    """
    actuator, amplifier, thermal = scenario.actuator, scenario.amplifier, scenario.thermal
    k = np.zeros(states.Z_SATURATION + 1)
    k[states.COMMAND_LAG] = 1 / actuator.command_lag
    k[[states.SERVO_BANDWIDTH, states.SERVO_DAMPING]] = 2 * math.pi * actuator.bandwidth, actuator.damping
    k[states.ACTUATOR_COMPLIANCE] = 1 / actuator.stiffness
    k[states.AMPLIFIER_RATE] = 2 * math.pi * amplifier.bandwidth
    k[[states.HEAT_CAPACITY, states.HEAT_LOSS, states.AMBIENT]] = thermal.capacity, thermal.loss, thermal.ambient
    # The drive is a current or a voltage: the coil's heat is R i² or u² / R.
    k[states.COIL_HEAT] = amplifier.resistance if scenario.drive_unit == "A" else 1 / amplifier.resistance
    # Saturation of z: there the rate of z is zero during sliding, (beta + gamma) |z|^n = A.
    k[states.Z_SATURATION] = (law[5] / (law[2] + law[3])) ** (1 / law[12])
    return k


def compute_rig_rate(scenario: Scenario, law: Array, parallel_slope: float = 0.0) -> float:
    """Return the fastest rate [1/s] of actuator and command under the viscous part of the damper's force.

    Args:
        scenario: its actuator is used.
        law: (14,) parameters of the damper in the paper's order.
        parallel_slope: [N s/m] steepest slope of the parallel forces over the velocity.
    """
    actuator = scenario.actuator
    servo = 2 * math.pi * actuator.bandwidth
    mass = actuator.stiffness / servo**2  # moving mass of a loop of this bandwidth and stiffness
    viscous = min(abs(law[6]) + 2 * abs(law[7]), 1e6)
    # Twice bandwidth times damping bounds the faster root of the loop, overdamped or not.
    return float(
        max(1 / actuator.command_lag, 2 * servo * max(actuator.damping, 1)) + (parallel_slope + viscous) / mass
    )


def make_plant_constants(
    scenario: Scenario, law: Array, effects: EffectFunctions, defined: DefinedFunctions | None
) -> Array:
    """Return all constants: those of the rig and those of its effects, defined or not.

    They are (CONSTANT_COUNT,). Where the elongation of the mounting is a table, its (G,) values follow. Its least
    slope then is the compliance of the fixture, because it bounds the steps.
    """
    k = np.zeros(states.CONSTANT_COUNT)
    k[: states.Z_SATURATION + 1] = make_rig_constants(scenario, law)
    k[states.DEAD_TIME], lag, k[states.LAGGED_FRACTION], k[states.LAG_COUNT] = effects.get_coil_lag()
    k[states.SECOND_LAG_RATE] = 1.0 / lag if lag > _MIN_LAG else 0.0
    k[[states.BRISTLE_RATE, states.PEAK_RATIO, states.STRIBECK_SPEED]] = effects.get_bristles()
    slope = _compute_max_slope(effects.make_parallel_force())
    slope += compute_steepest_slope(defined) if defined is not None else 0.0
    k[states.BASE_RATE] = compute_rig_rate(scenario, law, slope)
    k[states.HEAT_EXCHANGE_RATE] = effects.get_exchange_rate()
    k[states.BASE_RATE] += k[states.SECOND_LAG_RATE] + k[states.HEAT_EXCHANGE_RATE]
    k[states.BASE_RATE] += _MAX_LIP_SPEED * k[states.BRISTLE_RATE]
    k[states.BACKLASH] = bool(effects.select("displacement_backlash"))
    k[[states.FIXTURE_COMPLIANCE, states.GAP, states.HARDENING, states.FILM_DAMPING, states.IN_GAP_STIFFNESS]] = (
        effects.sum_connections()
    )
    k[states.MASS] = sum(form.function(1.0, *values) for form, values in effects.select("inertia"))
    k[states.COOLING_RATE] = effects.get_cooling_rate()
    k[states.FIELD_MEMORY] = bool(effects.select("field_memory"))
    table = effects.tabulate_elongation(_LEAST_LAG / max(abs(law[6]), _SMALLEST_DAMPING))
    if len(table):
        k[states.FIXTURE_COMPLIANCE] = float(np.min(np.diff(table) / np.diff(connection.FORCES)))
        k[[states.GAP, states.HARDENING, states.IN_GAP_STIFFNESS]] = 0.0
    return np.concatenate([k, table])


def _compute_max_slope(parallel: QuaternaryFunction) -> float:
    """Return the largest slope of the parallel forces over the velocity [N s/m], near rest."""
    speeds = np.geomspace(1e-5, 1.0, 60)
    return max(
        float(abs(parallel(0.0, v * 1.01, 1.0, 0.0) - parallel(0.0, v * 0.99, 1.0, 0.0)) / (0.02 * v))
        for v in speeds
    )

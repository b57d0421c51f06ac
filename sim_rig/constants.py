"""The constants of the motion that follow from a scenario: rates, weights and sizes, each at its place."""

import math

import numpy as np

from sim_rig import states as at
from sim_rig.acting import Effects
from sim_rig.compiled import Array, OfFour
from sim_rig.scenario import Scenario

_NO_LAG = 2e-5
"""[s] a second lag of the coil below which there is none."""
_SWIFT = 0.5
"""[m/s] up to which the bend of a lip is followed."""


def of_the_rig(scenario: Scenario, law: Array) -> Array:
    """Those of actuator, amplifier, heat and hysteresis, (10,), `LAG` to `SATURATED`: the same in every motion.

    Args:
        scenario: says what the rig is.
        law: (14,) parameters of the damper in the paper's order.
    """
    actuator, amplifier, thermal = scenario.actuator, scenario.amplifier, scenario.thermal
    k = np.zeros(at.SATURATED + 1)
    k[at.LAG] = 1 / actuator.command_lag
    k[at.SERVO] = 2 * math.pi * actuator.bandwidth
    k[at.DAMPING] = actuator.damping
    k[at.COMPLIANCE] = 1 / actuator.stiffness
    k[at.AMPLIFIER] = 2 * math.pi * amplifier.bandwidth
    k[at.HEAT_CAPACITY], k[at.HEAT_LOSS], k[at.AMBIENT] = thermal.capacity, thermal.loss, thermal.ambient
    k[at.COIL] = amplifier.resistance if scenario.drive_unit == "A" else 1 / amplifier.resistance
    k[at.SATURATED] = (law[5] / (law[2] + law[3])) ** (1 / law[12])
    return k


def fastest_of_the_rig(scenario: Scenario, law: Array, beside: float = 0.0) -> float:
    """Fastest rate [1/s] of actuator and command under the viscous part of the damper's force.

    Args:
        scenario: says what the rig is.
        law: (14,) parameters of the damper in the paper's order.
        beside: [N s/m] steepest slope over the velocity of the forces beside the law.
    """
    actuator = scenario.actuator
    servo = 2 * math.pi * actuator.bandwidth
    mass = actuator.stiffness / servo**2  # what a loop of this bandwidth and stiffness moves
    viscous = min(abs(law[6]) + 2 * abs(law[7]), 1e6)
    # Twice bandwidth times damping bounds the faster root of the loop, overdamped or not.
    return float(max(1 / actuator.command_lag, 2 * servo * max(actuator.damping, 1)) + (beside + viscous) / mass)


def of_the_plant(scenario: Scenario, law: Array, effects: Effects) -> Array:
    """All of them, (CONSTANTS,): what the rig is, and what the effects add."""
    k = np.zeros(at.CONSTANTS)
    k[: at.SATURATED + 1] = of_the_rig(scenario, law)
    k[at.DEAD_TIME], lag, k[at.SLOW_PART], k[at.LAYERS] = effects.coil()
    k[at.SECOND_LAG] = 1.0 / lag if lag > _NO_LAG else 0.0
    k[at.BRISTLES] = effects.bristles()
    k[at.EVER_PRESENT] = fastest_of_the_rig(scenario, law, _steepest(effects.parallel()))
    k[at.EXCHANGE] = effects.exchange()
    k[at.EVER_PRESENT] += k[at.SECOND_LAG] + k[at.EXCHANGE]
    k[at.EVER_PRESENT] += _SWIFT * k[at.BRISTLES]
    k[at.PLAY] = bool(effects.that("displacement_follower"))
    k[[at.GIVE, at.GAP, at.HARDENING, at.FILM, at.INSIDE]] = effects.connection()
    k[at.MASS] = sum(form.act(1.0, *values) for form, values in effects.that("inertia"))
    k[at.COOLING] = effects.cooling()
    k[at.MEMORY] = bool(effects.that("field_memory"))
    return k


def _steepest(parallel: OfFour) -> float:
    """Largest slope of the forces beside the law over the velocity [N s/m], near rest."""
    speeds = np.geomspace(1e-5, 1.0, 60)
    return max(
        float(abs(parallel(0.0, v * 1.01, 1.0, 0.0) - parallel(0.0, v * 0.99, 1.0, 0.0)) / (0.02 * v))
        for v in speeds
    )

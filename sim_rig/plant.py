"""The true specimen on its actuator: what happens, before any sensor looks.

Chain: commands -> actuator (lag, servo, droop) -> load cell -> mounting -> damper (law and forces beside it).
Time is an argument: a plant moves only when it is advanced, sample by sample on the wires or a whole record at
once, through the same compiled steps.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from identification.damper.effects import EFFECTS, Action, Form
from identification.damper.effects.connection import stretched
from sim_rig import integrate
from sim_rig.compiled import (
    Array,
    OfThree,
    OfTwo,
    Scales,
    chain_of,
    nothing,
    of_all_three,
    of_energy,
    of_first,
    of_first_two,
    of_motion,
    product_of,
    rigid,
    sum_of,
    with_values,
)
from sim_rig.errors import PlantError
from sim_rig.scenario import Scenario

_LONGEST_BLOCK = 1.25e-4
"""[s] the truth is kept at least this finely, so that filters can be run on it."""
_SHORTEST_BLOCK = 2.5e-5
"""[s] of the fastest sampling that the rig plays: what a dead time has to be kept for."""
_NO_LAG = 2e-5
"""[s] a second lag of the coil below which there is none."""
_SWIFT = 0.5
"""[m/s] up to which the bend of a lip is followed."""


class Truth(NamedTuple):
    """What happened during M samples of the commands, each cut into B blocks."""

    position: Array
    """(M B,) of the actuator [m], at the start of each block."""
    force: Array
    """(M B,) on the load cell [N], at the start of each block."""
    output: Array
    """(M,) of the amplifier [V or A], half way through each sample: held, by then."""
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


Values = tuple[float, ...]


class Effects:
    """The effects of a scenario, sorted by how they act."""

    def __init__(self, scenario: Scenario) -> None:
        self._played = [
            (form, tuple(effect.parameters[q.symbol] for q in form.parameters))
            for effect in scenario.effects
            for form in (EFFECTS[effect.name].form(effect.form),)
        ]

    def that(self, *acts: Action) -> list[tuple[Form, Values]]:
        """Those that act in certain ways, with their values."""
        return [(form, values) for form, values in self._played if form.acts in acts]

    def total(self, acts: Action) -> float:
        """Sum of what those give that are a single number: a delay [s], a lag [s], a give [m/N]."""
        return float(sum(form.act(*values) for form, values in self.that(acts)))

    def connection(self) -> tuple[float, float, float, float]:
        """Give [m/N], gap [m], hardening [1/m²] and film [N s/m] of what carries the damper."""
        parts = [form.act(*values) for form, values in self.that("connection")]
        give, gap, hardening, film = (float(sum(part[k] for part in parts)) for k in range(4))
        return give, gap, hardening, film

    def parallel(self) -> OfThree:
        """Force beside the law [N] over displacement [m], velocity [m/s] and the bend of a seal's lip [1]."""
        plain = [of_first_two(form.act, values) for form, values in self.that("parallel_force")]
        return sum_of(plain + [of_all_three(form.act, values) for form, values in self.that("dragging_force")])

    def bristles(self) -> float:
        """Rate [1/m] over the way with which a seal's lip bends."""
        for form, values in self.that("dragging_force"):
            return 1.0 / values[[q.symbol for q in form.parameters].index("bend")]
        return 0.0

    def follow(self) -> OfTwo:
        """Where the damper stands [m] over where it stood and where the actuator is."""
        followers = self.that("displacement_follower")
        return with_values(followers[0][0].act, followers[0][1]) if followers else rigid

    def scales(self) -> Scales:
        """Factors of alpha, c0 and c1 over displacement [m], velocity [m/s] and energy [J]."""
        moving = [of_motion(form.act, values) for form, values in self.that("scaling")]
        return product_of(moving + [of_energy(form.act, values) for form, values in self.that("softening")])

    def seen(self) -> OfTwo:
        """Field that the damper sees over the coil's own and what the iron remembers [V or A]."""
        maps = [
            with_values(form.act, values) if form.memory else of_first(form.act, values)
            for form, values in self.that("field", "field_memory")
        ]
        return chain_of(maps)

    def memory(self) -> OfTwo:
        """What the iron remembers after (remembered, change of the field)."""
        for form, values in self.that("field_memory"):
            if form.memory is not None:
                return with_values(form.memory, values)
        return nothing

    def cooling(self) -> float:
        """Rate [1/s] with which the energy leaves the damper."""
        for form, values in self.that("softening"):
            return 1.0 / values[[q.symbol for q in form.parameters].index("recovery")]
        return 0.0


class Plant:
    """One specimen on its actuator, moved by ``advance``.

    It starts settled: at rest at its first commanded position, the loop relaxed, the field at its drive.
    """

    def __init__(self, scenario: Scenario, displacement: float = 0.0, drive: float = 0.0) -> None:
        """Settle the specimen of a scenario at a displacement [m] and a drive [V or A].

        Raises:
            PlantError: the effects have no finite force there.
        """
        effects = Effects(scenario)
        self._law = np.array(scenario.parameters)
        self._parallel, self._follow, self._scales = effects.parallel(), effects.follow(), effects.scales()
        self._seen, self._memory = effects.seen(), effects.memory()
        self._constants = _constants(scenario, self._law, effects)
        self._command = displacement
        self._states, self._held = self._settled(displacement, drive)
        self._remembered, self._blocks = 0.0, 0
        dead = self._constants[integrate.DEAD_TIME] / _SHORTEST_BLOCK
        self._past = np.full(math.ceil(dead) + 3, float(drive))
        self._samples = 0

    def advance(self, dt: float, displacement: float, drive: float) -> Truth:
        """Move on by dt [s], the command going straight to ``displacement`` [m] and the drive [V or A] held.

        Raises:
            PlantError: the motion is not finite.
        """
        return self.play(dt, np.array([self._command, displacement]), np.array([drive]))

    def play(self, dt: float, command: Array, drive: Array) -> Truth:
        """Move on through M samples of dt [s].

        Args:
            dt: [s] one sample.
            command: (M+1,) commanded displacement [m] at the start of each sample and at the end of the last.
            drive: (M,) commanded drive [V or A], held through each sample.

        Raises:
            PlantError: the motion is not finite.
        """
        count, blocks = len(drive), blocks_in(dt)
        position, force, output = np.empty(count * blocks), np.empty(count * blocks), np.empty(count)
        damper, states = np.empty((count, 2)), np.empty((count, integrate.STATES))
        self._held, self._remembered, done = integrate.march(
            self._states, self._held, self._remembered, self._past, self._blocks,
            np.ascontiguousarray(command, float), np.ascontiguousarray(drive, float),
            dt / blocks, blocks, self._constants, self._law,
            self._follow, self._parallel, self._seen, self._memory, self._scales,
            position, force, output, damper, states,
        )  # fmt: skip
        self._blocks += count * blocks
        if done < count:
            raise PlantError(
                f"the specimen runs away {(self._samples + done) * dt:.3f} s into its motion, at "
                f"{states[done, integrate.POSITION]:.4g} m: no finite force; check the damper and the stroke"
            )
        self._command, self._samples = float(command[-1]), self._samples + count
        return Truth(
            position,
            force,
            output,
            damper[:, 0],
            damper[:, 1],
            states[:, integrate.Y],
            states[:, integrate.Z],
            states[:, integrate.FIELD],
            states[:, integrate.TEMPERATURE],
        )

    def _settled(self, displacement: float, drive: float) -> tuple[Array, float]:
        """States at rest under the load of the resting damper, and where that stands [m]."""
        stiffness, rest = self._law[11], self._law[13]
        place = displacement
        for _ in range(3):
            load = stiffness * (place - rest) + self._parallel(place, 0.0, 0.0)
            place = displacement - self._constants[integrate.COMPLIANCE] * load
        if not math.isfinite(place):
            raise PlantError(f"the specimen has no finite force at rest at {displacement:.4g} m")
        states = np.zeros(integrate.STATES)
        carrying = self._constants[[integrate.GIVE, integrate.GAP, integrate.HARDENING]]
        behind = place - stretched(load, *carrying) if carrying[0] > 0.0 else place
        states[[integrate.COMMAND, integrate.POSITION, integrate.Y]] = displacement, place, behind
        states[integrate.BEHIND] = behind
        states[[integrate.FIELD, integrate.OUTPUT, integrate.LAGGED]] = drive
        states[integrate.TEMPERATURE] = self._constants[integrate.AMBIENT]
        return states, place


def blocks_in(dt: float) -> int:
    """Blocks into which a sample of dt [s] is cut: an even number, each at most an eighth of a millisecond."""
    return max(2 * math.ceil(dt / _LONGEST_BLOCK / 2 - 1e-9), 2)


def faded_in(scenario: Scenario, time: Array, displacement: Array) -> Array:
    """The command with the actuator's start ramp: a motion that fades in from its first position.

    Args:
        scenario: says how long the ramp is.
        time: (N,) since the start [s].
        displacement: (N,) [m].
    """
    if scenario.actuator.start_ramp == 0:
        return displacement
    t = np.clip((time - time[0]) / scenario.actuator.start_ramp, 0.0, 1.0)
    fade = t**3 * (10 - 15 * t + 6 * t * t)
    return np.asarray(displacement[0] + (displacement - displacement[0]) * fade)


def chunks(count: int, size: int) -> Iterator[slice]:
    """Slices that cut ``count`` samples into pieces of ``size``."""
    return (slice(start, min(start + size, count)) for start in range(0, count, size))


def _constants(scenario: Scenario, law: Array, effects: Effects) -> Array:
    actuator, amplifier, thermal = scenario.actuator, scenario.amplifier, scenario.thermal
    servo = 2 * math.pi * actuator.bandwidth
    resistance = amplifier.resistance
    k = np.zeros(integrate.CONSTANTS)
    k[integrate.LAG] = 1 / actuator.command_lag
    k[integrate.SERVO] = servo
    k[integrate.DAMPING] = actuator.damping
    k[integrate.COMPLIANCE] = 1 / actuator.stiffness
    k[integrate.AMPLIFIER] = 2 * math.pi * amplifier.bandwidth
    k[integrate.HEAT_CAPACITY] = thermal.capacity
    k[integrate.HEAT_LOSS] = thermal.loss
    k[integrate.AMBIENT] = thermal.ambient
    k[integrate.COIL] = resistance if scenario.drive_unit == "A" else 1 / resistance
    k[integrate.SATURATED] = (law[5] / (law[2] + law[3])) ** (1 / law[12])
    mass = actuator.stiffness / servo**2
    steep = _steepest(effects.parallel())
    viscous = min(abs(law[6]) + 2 * abs(law[7]), 1e6)
    k[integrate.EVER_PRESENT] = (
        max(k[integrate.LAG], 2 * servo * max(actuator.damping, 1)) + (steep + viscous) / mass
    )
    dead, lag, k[integrate.SLOW_PART] = _coil(effects)
    k[integrate.SECOND_LAG] = 1.0 / lag if lag > _NO_LAG else 0.0
    k[integrate.DEAD_TIME] = dead
    k[integrate.EVER_PRESENT] += k[integrate.SECOND_LAG]
    k[integrate.BRISTLES] = effects.bristles()
    k[integrate.EVER_PRESENT] += _SWIFT * k[integrate.BRISTLES]
    k[integrate.PLAY] = bool(effects.that("displacement_follower"))
    k[[integrate.GIVE, integrate.GAP, integrate.HARDENING, integrate.FILM]] = effects.connection()
    k[integrate.MASS] = sum(form.act(1.0, *values) for form, values in effects.that("inertia"))
    k[integrate.COOLING] = effects.cooling()
    k[integrate.MEMORY] = bool(effects.that("field_memory"))
    return k


def _coil(effects: Effects) -> tuple[float, float, float]:
    """Dead time [s] and second lag [s] between output and field, and the part of the field behind the lag [1]."""
    acting = [form.act(*values) for form, values in effects.that("drive_delay")]
    dead, lag, part = acting[0] if acting else (0.0, 0.0, 1.0)
    return float(dead), float(lag), float(part)


def _steepest(parallel: OfThree) -> float:
    """Largest slope of the forces beside the law over the velocity [N s/m], near rest."""
    speeds = np.geomspace(1e-5, 1.0, 60)
    return max(
        float(abs(parallel(0.0, v * 1.01, 1.0) - parallel(0.0, v * 0.99, 1.0)) / (0.02 * v)) for v in speeds
    )

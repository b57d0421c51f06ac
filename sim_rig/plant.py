"""The true specimen on its actuator: what happens, before any sensor looks.

Chain: commands -> actuator (lag, servo, droop) -> load cell -> mounting -> damper (law and forces beside it).
Time is an argument: a plant moves only when it is advanced, sample by sample on the wires or a whole record at
once, through the same compiled steps.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from identification.damper.effects import EFFECTS
from identification.damper.effects.effect import Action
from sim_rig import integrate
from sim_rig.compiled import Array, rigid, sum_of, with_values
from sim_rig.errors import PlantError
from sim_rig.scenario import Scenario

_LONGEST_BLOCK = 1.25e-4
"""[s] the truth is kept at least this finely, so that filters can be run on it."""


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


@dataclass(frozen=True)
class Effects:
    """The effects of a scenario, sorted by how they act."""

    parallel: tuple[tuple[str, tuple[float, ...]], ...]
    """Forces beside the law: name, values."""
    follower: tuple[str, tuple[float, ...]] | None
    """What holds the displacement back."""
    force_lag: float
    """[s] by which the force channel comes late."""

    @staticmethod
    def of(scenario: Scenario) -> "Effects":
        """The effects at work in a scenario."""
        parallel, followers = _values(scenario, "parallel_force"), _values(scenario, "displacement_follower")
        lag = sum(-float(EFFECTS[name].act(0.0, *values)) for name, values in _values(scenario, "time_shift"))
        return Effects(tuple(parallel), followers[0] if followers else None, lag)


def _values(scenario: Scenario, acts: Action) -> list[tuple[str, tuple[float, ...]]]:
    chosen = [effect for effect in scenario.effects if EFFECTS[effect.name].acts == acts]
    return [(e.name, tuple(e.parameters[q.symbol] for q in EFFECTS[e.name].parameters)) for e in chosen]


class Plant:
    """One specimen on its actuator, moved by ``advance``.

    It starts settled: at rest at its first commanded position, the loop relaxed, the field at its drive.
    """

    def __init__(self, scenario: Scenario, displacement: float = 0.0, drive: float = 0.0) -> None:
        """Settle the specimen of a scenario at a displacement [m] and a drive [V or A].

        Raises:
            PlantError: the effects have no finite force there.
        """
        effects = Effects.of(scenario)
        self._law = np.array(scenario.parameters)
        self._parallel = sum_of([with_values(EFFECTS[name].act, values) for name, values in effects.parallel])
        self._follow = (
            with_values(EFFECTS[effects.follower[0]].act, effects.follower[1]) if effects.follower else rigid
        )
        self._constants = _constants(scenario, self._law, effects)
        self._command = displacement
        self._states, self._held = self._settled(displacement, drive)
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
        self._held, done = integrate.march(
            self._states, self._held, np.ascontiguousarray(command, float), np.ascontiguousarray(drive, float),
            dt / blocks, blocks, self._constants, self._law, self._follow, self._parallel,
            position, force, output, damper, states,
        )  # fmt: skip
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
            load = stiffness * (place - rest) + self._parallel(place, 0.0)
            place = displacement - self._constants[integrate.COMPLIANCE] * load
        if not math.isfinite(place):
            raise PlantError(f"the specimen has no finite force at rest at {displacement:.4g} m")
        states = np.zeros(integrate.STATES)
        states[[integrate.COMMAND, integrate.POSITION, integrate.Y]] = displacement, place, place
        states[[integrate.FIELD, integrate.OUTPUT]] = drive
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
    friction = sum(_steepest(name, values) for name, values in effects.parallel)
    viscous = min(abs(law[6]) + 2 * abs(law[7]), 1e6)
    k[integrate.EVER_PRESENT] = (
        max(k[integrate.LAG], 2 * servo * max(actuator.damping, 1)) + (friction + viscous) / mass
    )
    k[integrate.PLAY] = effects.follower is not None
    return k


def _steepest(name: str, values: tuple[float, ...]) -> float:
    """Largest slope of a force beside the law over the velocity [N s/m], near rest."""
    speeds = np.concatenate([[0.0], np.geomspace(1e-5, 1.0, 60)])
    return float(np.max(np.abs(EFFECTS[name].slopes(0.0, speeds, *values)[1])))

"""The true specimen on its actuator: what happens, before any sensor looks.

Chain: commands -> actuator (lag, servo, droop) -> load cell -> mounting -> damper (law and forces beside it).
Time is an argument: a plant moves only when it is advanced, sample by sample on the wires or a whole record at
once, through the same compiled steps.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from identification.damper.effects.connection import stretched
from sim_rig import integrate
from sim_rig import states as at
from sim_rig.acting import Effects
from sim_rig.compiled import Array
from sim_rig.constants import of_the_plant
from sim_rig.errors import PlantError
from sim_rig.scenario import Scenario

_LONGEST_BLOCK = 1.25e-4
"""[s] the truth is kept at least this finely, so that filters can be run on it."""
_SHORTEST_BLOCK = 2.5e-5
"""[s] of the fastest sampling that the rig plays: what a dead time has to be kept for."""


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
        self._constants = of_the_plant(scenario, self._law, effects)
        self._command = displacement
        self._states, self._held = self._settled(displacement, drive)
        self._remembered, self._blocks = 0.0, 0
        # How finely it will be played is not known yet: room for the finest.
        dead = self._constants[at.DEAD_TIME] / _SHORTEST_BLOCK
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
        damper, states = np.empty((count, 2)), np.empty((count, at.STATES))
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
                f"{states[done, at.POSITION]:.4g} m: no finite force; check the damper and the stroke"
            )
        self._command, self._samples = float(command[-1]), self._samples + count
        return Truth(
            position,
            force,
            output,
            damper[:, 0],
            damper[:, 1],
            states[:, at.Y],
            states[:, at.Z],
            states[:, at.FIELD],
            states[:, at.TEMPERATURE],
        )

    def _settled(self, displacement: float, drive: float) -> tuple[Array, float]:
        """States at rest under the load of the resting damper, and where that stands [m]."""
        stiffness, rest = self._law[11], self._law[13]
        place = displacement
        # The droop changes the load but little: each round leaves less than a hundredth of what was missing.
        for _ in range(3):
            load = stiffness * (place - rest) + self._parallel(place, 0.0, 0.0, place)
            place = displacement - self._constants[at.COMPLIANCE] * load
        if not math.isfinite(place):
            raise PlantError(f"the specimen has no finite force at rest at {displacement:.4g} m")
        states = np.zeros(at.STATES)
        carrying = self._constants[[at.GIVE, at.GAP, at.HARDENING, at.INSIDE]]
        behind = place - stretched(load, *carrying) if carrying[0] > 0.0 else place
        states[[at.COMMAND, at.POSITION, at.Y]] = displacement, place, behind
        states[[at.BEHIND, at.FOLLOWED]] = behind
        states[[at.FIELD, at.OUTPUT, at.LAGGED, at.TWICE]] = drive
        states[at.TEMPERATURE] = self._constants[at.AMBIENT]
        return states, place


def blocks_in(dt: float) -> int:
    """Blocks into which a sample of dt [s] is cut: an even number, each at most an eighth of a millisecond."""
    # Even, for the amplifier's output is read half way through a sample.
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

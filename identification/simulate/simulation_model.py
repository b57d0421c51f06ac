"""What a trajectory depends on, and what it answers."""

from dataclasses import dataclass
from dataclasses import field as default
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.damper import COORDINATES, Coordinates
from identification.damper.effects import Action, Effect, Form
from identification.simulate.curves import interpolate_hermite
from identification.simulate.kernel import StepCounts

SENSITIVITY_COLUMNS: tuple[str, ...] = (*(q.symbol for q in COORDINATES), "y0", "force_delay", "drive_delay")
"""Columns of the sensitivities; parameters of effects follow as ``effect.parameter``."""


@dataclass(frozen=True)
class Excitation:
    """What acts on the damper, sampled at one rate."""

    rate: float
    """[Hz]"""
    displacement: Array
    """(N,) at the actuator [m], smooth: noise in it becomes force."""
    velocity: Array
    """(N,) its derivative [m/s]."""
    acceleration: Array
    """(N,) its second derivative [m/s^2]."""
    drive: Array
    """(N,) held between samples [V or A]; with ``drive_finer`` as many more, ((N - 1) drive_finer + 1,)."""
    start: float = 0.0
    """[s] first sample, since the start of the run: drifts and hums know the time."""
    power: Array | None = None
    """(N,) that the damper dissipates [W], where it is known: it warms the damper. Without it, nothing does."""
    drive_oversampling: int = 1
    """[1] samples of the drive for each of the motion."""

    @property
    def time(self) -> Array:
        """(N,) since the start of the run [s]."""
        return self.start + np.arange(len(self.displacement)) / self.rate

    @property
    def sampled_drive(self) -> Array:
        """(N,) drive at the samples of the motion [V or A]."""
        return self.drive[:: self.drive_oversampling]

    def decimate(self, times: int) -> "Excitation":
        """Every so many samples of the motion; the drive keeps its own, so that its steps stay where they are."""
        count = (len(self.displacement) - 1) // times * times + 1
        thin = slice(0, count, times)
        power = None if self.power is None else self.power[thin]
        x, v, a = self.displacement[thin], self.velocity[thin], self.acceleration[thin]
        drive, finer = self.drive[: (count - 1) * self.drive_oversampling + 1], self.drive_oversampling * times
        return Excitation(self.rate / times, x, v, a, drive, self.start, power, finer)

    def oversample(self, times: int) -> "Excitation":
        """The same stroke at ``times`` the rate: (N - 1) times + 1 samples."""
        if times == 1:
            return self
        count = len(self.displacement)
        place = np.arange((count - 1) * times + 1) / times
        i = np.minimum(place.astype(np.int64), count - 2)
        t, h = place - i, 1.0 / self.rate
        x, _ = interpolate_hermite(self.displacement, self.velocity, i, t, h)
        v, a = interpolate_hermite(self.velocity, self.acceleration, i, t, h)
        power = None if self.power is None else np.interp(place, np.arange(len(self.power)), self.power)
        # Held between samples, as it came: its steps must not become ramps.
        drive = np.repeat(self.sampled_drive, times)[: len(place)]
        return Excitation(self.rate * times, x, v, a, drive, self.start, power)


class ActiveEffect(NamedTuple):
    """An effect with values for its parameters."""

    effect: Effect
    values: tuple[float, ...]
    form_name: str | None = None
    """Which of its forms; the usual one if None."""

    @property
    def form(self) -> Form:
        """The form that acts."""
        return self.effect.find_form(self.form_name)


@dataclass(frozen=True)
class SimulationModel:
    """Everything that a trajectory depends on beside its inputs."""

    coordinates: Coordinates
    y0: float = 0.0
    """[m] inner displacement at the first sample."""
    force_delay: float = 0.0
    """[s] lag of the force channel behind the displacement channel."""
    drive_delay: float = 0.0
    """[s] lag of the force channel behind the drive channel, in addition."""
    effects: tuple[ActiveEffect, ...] = ()

    def select_forms(self, *actions: Action) -> list[tuple[int, Form, tuple[float, ...]]]:
        """The effects that act in certain ways: column of the first parameter among the effects', form, values."""
        starts = np.cumsum([0, *(len(e.values) for e in self.effects)])
        return [
            (int(at), e.form, e.values)
            for at, e in zip(starts, self.effects, strict=False)
            if e.form.action in actions
        ]


@dataclass(frozen=True)
class Trajectory:
    """What the model answers."""

    force: Array
    """(N,) [N]"""
    y: Array
    """(N,) inner displacement [m]."""
    zeta: Array
    """(N,) hysteretic state over its saturation [1]."""
    field: Array
    """(N,) field that the damper sees [V or A]."""
    step_counts: StepCounts
    """(N-1,) steps taken in each sample; hand it back to keep later trajectories smooth in their unknowns."""
    sensitivities: Array = default(default_factory=lambda: np.empty((0, 0)))
    """(N, unknowns) derivative of the force over each of ``columns``; empty unless asked for."""
    columns: tuple[str, ...] = ()

"""Inputs of a simulation and its response."""

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
    """Input of a simulation: motion and drive, sampled at one rate."""

    rate: float
    """Sampling rate of the motion [Hz]."""
    displacement: Array
    """(N,) displacement at the actuator [m]; smooth, because noise in it becomes force."""
    velocity: Array
    """(N,) first derivative of the displacement [m/s]."""
    acceleration: Array
    """(N,) second derivative of the displacement [m/s^2]."""
    drive: Array
    """((N - 1) drive_oversampling + 1,) drive [V or A], held between samples."""
    start: float = 0.0
    """Time of the first sample since the start of the run [s]; drift and mains hum depend on it."""
    power: Array | None = None
    """(N,) power that the damper dissipates [W] and that heats it; None if unknown, then nothing heats it."""
    drive_oversampling: int = 1
    """Samples of the drive per sample of the motion [1]."""

    @property
    def time(self) -> Array:
        """(N,) time since the start of the run [s]."""
        return self.start + np.arange(len(self.displacement)) / self.rate

    @property
    def sampled_drive(self) -> Array:
        """(N,) drive at the samples of the motion [V or A]."""
        return self.drive[:: self.drive_oversampling]

    def decimate(self, times: int) -> "Excitation":
        """Return every n-th sample of the motion; the drive keeps all samples, so its steps keep their times."""
        count = (len(self.displacement) - 1) // times * times + 1
        thin = slice(0, count, times)
        power = None if self.power is None else self.power[thin]
        x, v, a = self.displacement[thin], self.velocity[thin], self.acceleration[thin]
        drive, finer = self.drive[: (count - 1) * self.drive_oversampling + 1], self.drive_oversampling * times
        return Excitation(self.rate / times, x, v, a, drive, self.start, power, finer)

    def oversample(self, times: int) -> "Excitation":
        """Return the excitation at ``times`` the rate, with (N - 1) times + 1 samples."""
        if times == 1:
            return self
        count = len(self.displacement)
        place = np.arange((count - 1) * times + 1) / times
        i = np.minimum(place.astype(np.int64), count - 2)
        t, h = place - i, 1.0 / self.rate
        x, _ = interpolate_hermite(self.displacement, self.velocity, i, t, h)
        v, a = interpolate_hermite(self.velocity, self.acceleration, i, t, h)
        power = None if self.power is None else np.interp(place, np.arange(len(self.power)), self.power)
        # The drive is held between samples, because its steps must not become ramps.
        drive = np.repeat(self.sampled_drive, times)[: len(place)]
        return Excitation(self.rate * times, x, v, a, drive, self.start, power)


class ActiveEffect(NamedTuple):
    """An effect with values for its parameters."""

    effect: Effect
    values: tuple[float, ...]
    form_name: str | None = None
    """Name of its form; None for the usual form."""

    @property
    def form(self) -> Form:
        """Form of the effect."""
        return self.effect.find_form(self.form_name)


@dataclass(frozen=True)
class SimulationModel:
    """All values on which a simulation depends in addition to its excitation."""

    coordinates: Coordinates
    y0: float = 0.0
    """Inner displacement at the first sample [m]."""
    force_delay: float = 0.0
    """Delay of the force channel after the displacement channel [s]."""
    drive_delay: float = 0.0
    """Additional delay of the force channel after the drive channel [s]."""
    effects: tuple[ActiveEffect, ...] = ()

    def select_forms(self, *actions: Action) -> list[tuple[int, Form, tuple[float, ...]]]:
        """Return column, form and values of the effects with one of these actions.

        The column is that of the first parameter, counted over the parameters of all effects.
        """
        starts = np.cumsum([0, *(len(e.values) for e in self.effects)])
        return [
            (int(at), e.form, e.values)
            for at, e in zip(starts, self.effects, strict=False)
            if e.form.action in actions
        ]


@dataclass(frozen=True)
class Response:
    """Result of a simulation over time."""

    force: Array
    """(N,) recorded force that the model predicts [N]."""
    y: Array
    """(N,) inner displacement [m]."""
    zeta: Array
    """(N,) hysteretic variable relative to its saturation [1]."""
    field: Array
    """(N,) field in the damper [V or A]."""
    step_counts: StepCounts
    """(N-1,) steps in each sample; a later simulation with the same steps is smooth in the unknowns."""
    sensitivities: Array = default(default_factory=lambda: np.empty((0, 0)))
    """(N, U) derivatives of the force over ``columns``; empty unless requested."""
    columns: tuple[str, ...] = ()

"""Stretch of a recording prepared for the fit, with the simulation of its recorded force."""

from dataclasses import dataclass, replace
from functools import cached_property

from identification.arrays import Array
from identification.fitting.force_channel import LowPass, compute_filter_delay
from identification.fitting.log_correction import NO_CORRECTION, LogCorrection
from identification.signals import StepShifts
from identification.simulate import Excitation, SimulationModel, simulate

_MAX_BACKLASH_OVERSAMPLING = 8
"""Largest oversampling of backlash in a decimated piece."""


@dataclass(frozen=True)
class Piece:
    """One continuous stretch of a recording, prepared for the fit."""

    name: str
    excitation: Excitation
    force: Array
    """(N,) recorded force [N]."""
    train: Array
    """(N,) 1.0 where the sample is fitted, 0.0 where it is held out or invalid."""
    force_delay: float = 0.0
    """Known delay of the force channel after the displacement channel [s]."""
    drive_delay: float = 0.0
    """Known additional delay of the force channel after the drive channel [s]."""
    low_pass: LowPass | None = None
    """Filter of the force channel."""
    backlash_oversampling: int = 4
    """Oversampling where the mounting has backlash."""
    log: int = 0
    """Index of its log."""
    correction: LogCorrection = NO_CORRECTION
    """Correction of its log."""
    step_shifts: StepShifts | None = None
    """Shifts of the steps that its drive contains; None for a drive as recorded."""

    def simulate(self, model: SimulationModel, *, sensitivities: bool = False) -> tuple[Array, Array]:
        """Return the force (N,) [N] as its channel would record it, and on request its sensitivities (N, U)."""
        corrected = replace(model, coordinates=self.correction.apply(model.coordinates))
        force, J = self._simulate_channel(corrected, sensitivities)
        return force, self.correction.apply_chain_rule(J) if sensitivities else J

    def _simulate_channel(self, model: SimulationModel, sensitivities: bool) -> tuple[Array, Array]:
        if self.low_pass is not None:
            excitation = self._oversample(self.low_pass.oversampling)
            response = simulate(model, excitation, sensitivities=sensitivities)
            force, J = self.low_pass.apply(response.force), response.sensitivities
            return force, self.low_pass.apply(J) if sensitivities else J
        # Backlash begins and ends within a sample, where the damper's velocity jumps.
        factor = self.backlash_oversampling if model.select_forms("displacement_backlash") else 1
        response = simulate(model, self._oversample(factor), sensitivities=sensitivities)
        return response.force[::factor], response.sensitivities[::factor]

    def make_fast(self) -> "Piece":
        """Return the fast variant: filter and backlash at the samples only, slightly inexact."""
        low_pass = replace(self.low_pass, oversampling=1) if self.low_pass else None
        return replace(self, low_pass=low_pass, backlash_oversampling=1)

    def decimate(self, factor: int) -> "Piece":
        """Return the piece at every n-th sample: too few for the filter, of which only the delay remains."""
        excitation = self.excitation.decimate(factor)
        # The decimated excitation may lack the last samples.
        part = slice(0, len(excitation.displacement) * factor, factor)
        force_delay = self.force_delay + compute_filter_delay(
            self.low_pass.channel_filter if self.low_pass else None
        )
        return replace(
            self,
            excitation=excitation,
            force=self.force[part],
            train=self.train[part],
            low_pass=None,
            force_delay=force_delay,
            backlash_oversampling=min(factor * self.backlash_oversampling, _MAX_BACKLASH_OVERSAMPLING),
        )

    def _oversample(self, factor: int) -> Excitation:
        """Return the excitation at a higher rate, computed once."""
        if factor not in self._oversampled_excitations:
            self._oversampled_excitations[factor] = self.excitation.oversample(factor)
        return self._oversampled_excitations[factor]

    @cached_property
    def _oversampled_excitations(self) -> dict[int, Excitation]:
        # Not a field, so that `replace` starts with an empty cache.
        return {}

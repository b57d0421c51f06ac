"""Problem of all fitted samples, and the smaller ones on which sets of effects are searched and screened."""

from dataclasses import dataclass
from functools import cached_property

from identification.arrays import Array
from identification.fitting import Problem, make_starting_points
from identification.gap.selection.search_settings import SearchSettings

_BLOCK_ANGLE = 4.0
"""Length of a block of the block evidence, over half stroke divided by peak speed [1]."""
_USUAL_RATE = 10.0
"""Peak speed over half stroke [1/s] of the recordings for which the sampling rates of the settings are stated."""


@dataclass(frozen=True)
class SearchProblems:
    """The law on one recording, on all fitted samples and on fewer."""

    full: Problem
    """Problem of all fitted samples."""
    settings: SearchSettings

    @property
    def block_length(self) -> float:
        """Length of a block of the block evidence [s]: part of a stroke of this recording."""
        return _BLOCK_ANGLE / self.full.space.scales.rate

    @property
    def screening_rate(self) -> float:
        """Sampling rate [Hz] at which further effects are screened."""
        return self._resolve_rate(self.settings.screening_rate)

    @cached_property
    def decimated(self) -> Problem:
        """Problem of the decimated data on which sets are searched, as a fast variant."""
        rate = max(p.excitation.rate for p in self.full.pieces)
        samples = sum(len(p.force) for p in self.full.pieces)
        factor = rate / self._resolve_rate(self.settings.decimation_rate)
        factor = max(factor, samples / self.settings.long_recording)
        # A long recording of a slow damper may lose the electronics, but not the motion.
        factor = min(factor, rate / (self.settings.screening_rate * self._relative_rate))
        return self.full.make_fast().decimate(max(1, round(factor)))

    @cached_property
    def screening(self) -> Problem:
        """Problem of the data on which further effects are screened."""
        highest = max(p.excitation.rate for p in self.decimated.pieces)
        return self.decimated.decimate(max(1, round(highest / self.screening_rate)))

    @cached_property
    def regression_start(self) -> Array:
        """Unknowns (U,) of the law alone from the regression."""
        return make_starting_points(self.decimated)[0]

    def _resolve_rate(self, rate: float) -> float:
        """Return a sampling rate [Hz] that resolves the electronics and the motion of this recording."""
        return rate * max(1.0, self._relative_rate)

    @property
    def _relative_rate(self) -> float:
        """Rate of the motion over that of the usual recordings [1]."""
        return self.full.space.scales.rate / _USUAL_RATE

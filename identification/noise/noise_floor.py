"""Noise floor of the recorded force: the part that no model of the damper can explain.

Where whole cycles repeat, a fit of the cycle, of its slow change and of the achieved motion is subtracted from the
force. The floor is the remainder, for noise of any spectrum. Fourth differences give a lower bound: they see only
noise too fast for a damper. Where nothing repeats, the floor lies between this bound and the error of the best
model.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from identification.logs import PERIODIC_MOTIONS, Stretch
from identification.noise.high_frequency import estimate_high_frequency_noise
from identification.noise.mains_line import MainsLine, find_mains_line
from identification.noise.repeated_windows import MIN_CYCLES, RepeatedWindow, find_repeated_windows
from identification.noise.smooth_spectrum import fit_smooth_spectrum
from identification.noise.spectrum import (
    WindowNoise,
    collect_known_bins,
    estimate_window_noise,
    fit_low_frequency_spectrum,
    make_spectrum,
)
from identification.noise.time_scales import (
    NO_SLOW_VARIANCE,
    NORMAL_95,
    ScaleVariance,
    SlowVariance,
    average_scales,
)
from identification.noise.whitening import WhiteningFilter, design_whitening_filter
from identification.noise.window_fit import CycleFit, WindowFit
from identification.signals import Motion
from identification.threads import use_one_thread

_COLOUR_RANGE = 3.0
"""Factor by which coloured noise or fast repeated force usually separates the two estimates, either way."""
_HIGH_FREQUENCY_SCATTER = 1.6
"""Relative standard deviation of the high-frequency estimate times the root of its samples [1]; measured."""
_MIN_SAMPLES = 200
"""Smallest number of samples in repeated windows for an estimate."""
_MAX_DEVIATION = 0.15
"""Largest relative standard deviation of the floor [1]; a less precise one could hide a gap of its own size."""
_MOTION_RATIO = 2.0
"""Threshold on the motion difference of a cycle over that of the best quarter: above it, it does not repeat."""
_SAME_MOTION = 2e-4
"""Motion difference over the displacement's standard deviation up to which a cycle always repeats."""


@dataclass(frozen=True)
class NoiseFloorEstimate:
    """Noise of a recorded force."""

    noise: float
    """Noise floor [N]."""
    cycle_to_cycle: float | None
    """Estimate from repeated cycles [N]; None if no cycles repeat."""
    high_frequency: float
    """Estimate from fourth differences [N]."""
    basis: str
    """Estimate on which ``noise`` rests, and the reason, as text for a person."""
    deviation: float | None = None
    """Standard deviation of ``noise`` [N]; None if it is only a lower bound."""
    scales: tuple[ScaleVariance, ...] = ()
    """Variance of the noise by time scale; empty if it is not known, or if sampling rates differ."""
    slow_variance: SlowVariance = NO_SLOW_VARIANCE
    """Variance of slow noise in each factor e of the frequency."""

    @property
    def is_known(self) -> bool:
        """True if the floor is more than a lower bound."""
        return self.deviation is not None

    @property
    def coloured_share(self) -> float:
        """Part of the variance that is not white [1]; 0 where the floor is not known."""
        if not self.is_known:
            return 0.0
        return max(1.0 - (self.high_frequency / max(self.noise, 1e-300)) ** 2, 0.0)

    @cached_property
    def whitening(self) -> WhiteningFilter:
        """Filter that makes the noise white; of one tap where its colour is not known."""
        return design_whitening_filter(self.scales, self.high_frequency)

    def compute_chance(self, samples: int) -> float:
        """Return the standard deviation of the mean square of some samples of noise, over its variance [1]."""
        if not self.scales:
            return math.sqrt(2.0 / samples)
        # Noise slower than the samples is the same in all of them: its parts add up before they are squared.
        fast = [s for s in self.scales if 2 * s.samples < samples]
        slower = max(self.noise**2 - sum(s.variance for s in fast), 0.0)
        longest = fast[-1].samples if fast else samples
        squares = sum(s.compute_chance(samples) ** 2 for s in fast)
        squares += slower**2 * min(8.0 * longest / samples, 2.0)
        return math.sqrt(squares) / self.noise**2

    def discard_cycles(self, reason: str) -> "NoiseFloorEstimate":
        """Return the estimate without repeated cycles, a lower bound, with the reason as text for a person."""
        fast = self.high_frequency
        return NoiseFloorEstimate(fast, self.cycle_to_cycle, fast, f"high frequency: {reason}")

    def get_interval(self, error: float) -> tuple[float, float]:
        """Return the 95 % interval of the floor [N].

        Args:
            error: error of the best model [N], the upper bound where no cycles repeat.
        """
        if self.deviation is None:
            return min(self.noise, error), max(self.noise, error)
        return max(self.noise - NORMAL_95 * self.deviation, 0.0), self.noise + NORMAL_95 * self.deviation


class _Estimate(NamedTuple):
    """Estimate of a noise."""

    noise: float
    """[N]"""
    deviation: float
    """Its standard deviation [N]."""


class _StretchNoise(NamedTuple):
    """Noise in the windows of one stretch."""

    windows: list[WindowNoise]
    line: MainsLine | None
    slow_variance: SlowVariance = NO_SLOW_VARIANCE
    """Variance of slow noise in each factor e of the frequency."""


def estimate_floor(stretches: Sequence[Stretch], motions: Sequence[Motion]) -> NoiseFloorEstimate:
    """Estimate the common noise of the force of some stretches, without the effect of displacement noise.

    If the noise is white, the estimates from repeated cycles and from high frequencies agree. Their difference
    gives the probability of that. A mains line is not part of the floor: the effect ``mains_hum`` predicts it.

    Args:
        stretches: recordings; ``measured`` marks the samples that are used.
        motions: their estimated motions.
    """
    counts = np.array([np.count_nonzero(s.measured) for s in stretches], float)
    squares = [estimate_high_frequency_noise(s.force[s.measured]) ** 2 for s in stretches]
    high_frequency = math.sqrt(float(counts @ squares) / max(float(counts.sum()), 1.0))
    with use_one_thread():
        parts = [_estimate_stretch(s, m) for s, m in zip(stretches, motions, strict=True)]
    windows = [window for part in parts for window in part.windows]
    samples = sum(w.samples for w in windows)
    if samples < _MIN_SAMPLES:
        reason = _explain_missing_repeats(stretches, samples)
        return NoiseFloorEstimate(high_frequency, None, high_frequency, f"high frequency: {reason}")
    cycle_to_cycle, deviation = _combine_windows(windows)
    basis = f"cycle to cycle over {sum(w.cycles for w in windows)} cycles{_describe_extent(parts)}"
    other = _HIGH_FREQUENCY_SCATTER * high_frequency / math.sqrt(max(float(counts.sum()), 1.0))
    repeated, fast = _Estimate(cycle_to_cycle, deviation), _Estimate(high_frequency, other)
    white = _compute_white_probability(repeated, fast)
    basis = f"{basis}; {_compare(cycle_to_cycle, high_frequency, white)}{_describe_lines(parts)}"
    noise, combined = _mix(white, _average(repeated, fast), repeated)
    if combined > _MAX_DEVIATION * noise:
        reason = f"{samples} samples in repeated cycles only give {noise:.2g} ± {combined:.1g} N"
        return NoiseFloorEstimate(high_frequency, None, high_frequency, f"high frequency: {reason}")
    scales = _average_scales(windows) if len({s.rate for s in stretches}) == 1 else ()
    return NoiseFloorEstimate(
        noise, cycle_to_cycle, high_frequency, basis, combined, scales, _average_slow_variance(parts)
    )


def _compute_white_probability(repeated: _Estimate, fast: _Estimate) -> float:
    """Compute the probability [1] that the noise is white and does not repeat, from two estimates of it.

    White noise lets them differ by their errors. Otherwise any ratio of the two within a factor of three, either
    way, is equally probable. Both cases have the same prior probability.
    """
    deviation = math.hypot(repeated.deviation, fast.deviation)
    if deviation == 0.0:
        return float(repeated.noise == fast.noise)
    distance = (repeated.noise - fast.noise) / deviation
    white = math.exp(-0.5 * distance**2) / (math.sqrt(2.0 * math.pi) * deviation)
    other = 1.0 / (2.0 * math.log(_COLOUR_RANGE) * max(repeated.noise, 1e-300))
    return white / (white + other)


def _average(first: _Estimate, second: _Estimate) -> _Estimate:
    """Return the average of two estimates of one noise, weighted by their precision."""
    total = math.hypot(first.deviation, second.deviation)
    if total == 0.0:
        return first
    share = (second.deviation / total) ** 2
    noise = share * first.noise + (1.0 - share) * second.noise
    return _Estimate(noise, first.deviation * second.deviation / total)


def _mix(probability: float, first: _Estimate, second: _Estimate) -> _Estimate:
    """Return mean and standard deviation of a noise that is the first estimate with a probability [1]."""
    mean = probability * first.noise + (1.0 - probability) * second.noise
    squares = [e.deviation**2 + (e.noise - mean) ** 2 for e in (first, second)]
    return _Estimate(mean, math.sqrt(probability * squares[0] + (1.0 - probability) * squares[1]))


def _estimate_stretch(stretch: Stretch, motion: Motion) -> _StretchNoise:
    windows = find_repeated_windows(stretch, motion.displacement, motion.noise)
    fits = [WindowFit(fit) for fit in _exclude_disturbed_cycles(windows, float(np.std(stretch.displacement)))]
    if not fits:
        return _StretchNoise([], None)
    remainders = [fit.remove(fit.window.force[:, None])[:, 0] for fit in fits]
    line = find_mains_line(fits, remainders, stretch.rate)
    cleaned = remainders if line is None else line.remainders
    spectra = [make_spectrum(fit, remainder, stretch.rate) for fit, remainder in zip(fits, cleaned, strict=True)]
    # A window whose fit takes nearly all of the noise tells nothing.
    spectra = [spectrum for spectrum in spectra if spectrum.is_known.any()]
    if not spectra:
        return _StretchNoise([], line)
    low, smooth = fit_low_frequency_spectrum(spectra), fit_smooth_spectrum(*collect_known_bins(spectra))
    noises = [estimate_window_noise(s, smooth, len(stretch.force) / stretch.rate) for s in spectra]
    slow = SlowVariance(2.0 * low.pink / stretch.rate, 2.0 * low.pink_deviation / stretch.rate)
    return _StretchNoise(noises, line, slow)


def _exclude_disturbed_cycles(windows: Sequence[RepeatedWindow], size: float) -> list[CycleFit]:
    """Return the fits of the windows without the cycles whose motion does not repeat.

    After a disturbance the force differs too. A force that is steep over some micrometres is not explained by
    terms that are linear in the difference.

    Args:
        windows: the windows of one stretch.
        size: standard deviation of its displacement [m].
    """
    fits = [CycleFit(window) for window in windows]
    if not fits:
        return []
    differences = [fit.measure_motion_difference() for fit in fits]
    limit = max(_MOTION_RATIO * float(np.quantile(np.concatenate(differences), 0.25)), _SAME_MOTION * size)
    repeated = [d <= limit for d in differences]
    return [
        fit if r.all() else CycleFit(fit.window._replace(valid=fit.window.valid & r[fit.window.cycle]))
        for fit, r in zip(fits, repeated, strict=True)
        if np.count_nonzero(r) >= MIN_CYCLES
    ]


def _average_scales(windows: Sequence[WindowNoise]) -> tuple[ScaleVariance, ...]:
    """Return the mean variance of the noise of all windows by time scale."""
    return average_scales([w.scales for w in windows], [w.samples for w in windows])


def _average_slow_variance(parts: Sequence[_StretchNoise]) -> SlowVariance:
    """Return the mean variance of slow noise in each factor e of the frequency."""
    weights = np.array([sum(w.samples for w in part.windows) for part in parts], float)
    weights = weights / weights.sum()
    variance, deviation = np.array([part.slow_variance for part in parts]).T
    return SlowVariance(float(weights @ variance), float(np.linalg.norm(weights * deviation)))


def _combine_windows(noises: Sequence[WindowNoise]) -> tuple[float, float]:
    """Return the noise of all windows [N] and its standard deviation [N]."""
    weights = np.array([n.samples for n in noises], float) / sum(n.samples for n in noises)
    variance = float(weights @ [n.variance for n in noises])
    # Windows have independent noise, but one extrapolation, which may be wrong by all of it.
    independent = float(np.linalg.norm(weights * [n.deviation for n in noises]))
    deviation = math.hypot(independent, float(weights @ [n.extrapolated for n in noises]))
    return math.sqrt(variance), 0.5 * deviation / math.sqrt(max(variance, 1e-300))


def _compare(cycle_to_cycle: float, high_frequency: float, white: float) -> str:
    """Return the comparison of the two estimates as text; ``white`` is the probability of white noise [1]."""
    if white > 0.5:
        return "the high-frequency estimate agrees"
    ratio = cycle_to_cycle / max(high_frequency, 1e-12)
    if ratio > 1.0:
        return (
            f"{ratio:.2f} times the high-frequency estimate: some force does not repeat, or the noise is coloured"
        )
    return f"only {ratio:.2f} of the high-frequency estimate: fast force repeats with the stroke"


def _describe_extent(parts: Sequence[_StretchNoise]) -> str:
    """Return in how many of several stretches cycles repeat, as text."""
    repeated = sum(bool(part.windows) for part in parts)
    return "" if len(parts) == 1 else f" in {repeated} of {len(parts)} stretches"


def _describe_lines(parts: Sequence[_StretchNoise]) -> str:
    """Return the strongest mains line as text; empty if there is none."""
    lines = [part.line for part in parts if part.line is not None]
    if not lines:
        return ""
    line = max(lines, key=lambda each: each.deviation)
    size = f"{line.deviation:.3g} N rms at {line.frequency:.2f} Hz"
    return f"; without a mains line of {size}, which is not part of the floor"


def _explain_missing_repeats(stretches: Sequence[Stretch], samples: int) -> str:
    if not any(segment.motion in PERIODIC_MOTIONS for s in stretches for segment in s.segments):
        return "no periodic motion, so no cycles repeat"
    if samples <= 0:
        return "no two cycles with the same steady motion and drive"
    return f"only {samples} samples in repeated cycles (minimum {_MIN_SAMPLES})"

"""Shrinkage of the gap by named effects, as it is expected on another run of the same damper."""

import math
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from identification.arrays import Array, BoolArray
from identification.gap.data.cycles import Indices

NEAR_FLOOR_RATIO = 1.02
"""Threshold on the RMSE relative to the noise floor: below it, the gap is too small for parts of it."""
_DRAWS = 1000
"""Other runs that are drawn."""
_FORM_DEVIATION = 0.8
"""Standard deviation of the log odds of the form error between many strokes. Origin: 25 trial cases."""
_FEW_STROKES_DEVIATION = 0.4
"""Further deviation of these log odds, divided by the number of strokes. Origin: 25 trial cases."""
_GAP_DEVIATION = 0.35
"""Standard deviation of the logarithm of the gap between runs. Origin: 25 trial cases."""
_MIN_GAP_SHARE = 1e-2
"""Smallest gap by which others are divided, relative to the variance of the noise."""


class RemainingGap(NamedTuple):
    """Parts of the gap that remain on other runs, as they were drawn; each array is (draws,)."""

    form_error: Array
    """Part of the gap that the effects do not describe [1]."""
    input_noise: Array
    """Part that the noise of the motion adds [1]."""
    noise: float
    """Standard deviation of the noise in the recorded force [N]."""


@dataclass(frozen=True)
class Shrinkage:
    """Shrinkage of the gap on the held-out cycles."""

    before: float
    """RMSE without effects [N]."""
    after: float
    """RMSE with effects [N], as expected of another run."""
    value: float | None
    """Expected shrinkage [1]; None where there is no gap to shrink."""
    ci95: tuple[float, float] | None
    """95 % interval of the shrinkage for other runs."""
    expected_benefit: float | None = None
    """Part of a whole run's gap that the effects are expected to close if the run is repeated [1]."""
    remaining: RemainingGap | None = field(default=None, compare=False, repr=False)
    """Drawn parts of the gap that remain; None where nothing shrinks."""


class CycleErrors(NamedTuple):
    """Errors of all fitted and held-out cycles; each array is (cycles,)."""

    before: Array
    """Sum of squared residuals without effects [N²]."""
    after: Array
    """Sum of squared residuals with effects [N²]."""
    counts: Array
    """Number of samples."""
    segment: Indices
    """Number of the cycle's segment."""
    held_out: BoolArray
    """True where the cycle was kept out of every fit."""

    def compute_means(self) -> tuple[float, float]:
        """Return the mean squares [N²] without and with effects on the held-out cycles."""
        total = float(self.counts[self.held_out].sum())
        return float(self.before[self.held_out].sum()) / total, float(self.after[self.held_out].sum()) / total


class HeldOutErrors(NamedTuple):
    """Errors of the held-out cycles; each array is (cycles,)."""

    before: Array
    """Sum of squared residuals without effects [N²]."""
    after: Array
    """Sum of squared residuals with all named effects [N²]."""
    without: dict[str, Array]
    """The same without one of them, by its name [N²]."""
    counts: Array
    """Number of samples."""
    segment: Indices
    """Number of the cycle's segment."""


class Replicates(NamedTuple):
    """Mean squared changes of the simulated force in simulations of the same strokes with new input noise."""

    evaluated: float
    """Over all fitted and held-out samples [N²]."""
    held_out: float
    """Over the held-out samples [N²]."""
    runs: Array
    """(runs,) over all recorded samples, including starts and ends [N²]."""
    before: float
    """Mean squared residual without effects [N²] over all recorded samples."""


def estimate_shrinkage(
    errors: CycleErrors, noise: float, replicates: Replicates, strokes: int, chance: float = 0.0
) -> Shrinkage:
    """Estimate the expected shrinkage on another run of the same damper, with an interval (decision 0014).

    With effects, two errors remain on another run:

    - The form error: the error of all cycles beyond noise and input noise. Fitted cycles count as well, because
      two dozen parameters absorb hardly any of it and the held-out cycles are a small sample. It is never
      negative. It differs between strokes, the more so the fewer strokes were recorded. Segments and then cycles
      are resampled. Many strokes are a sample, whose mean holds for other strokes. Few strokes are not: on others
      the form error is larger on average. What differs is its part of the gap, which lies between none and all.
    - The input noise of that run. It is largest at starts and ends, where the motion is known from one side only.
      Fits exclude these samples; a prediction contains them.

    Args:
        errors: errors of the cycles.
        noise: standard deviation of the noise in the recorded force [N].
        replicates: simulations with effects and with new input noise.
        strokes: number of recorded strokes of different amplitude or frequency.
        chance: excess of the held-out mean square over that of the noise which sampling alone can produce [N²].
    """
    before, after = errors.compute_means()
    if before < (NEAR_FLOOR_RATIO * noise) ** 2:
        return Shrinkage(math.sqrt(before), math.sqrt(after), None, None)
    if errors.before is errors.after or np.array_equal(errors.before, errors.after):
        return Shrinkage(math.sqrt(before), math.sqrt(after), 0.0, (0.0, 0.0))
    remaining = _sample_remaining_gap(errors, noise, replicates, strokes)
    benefit = _estimate_benefit(after - chance, noise, replicates)
    return _summarise(Shrinkage(math.sqrt(before), math.sqrt(after), None, None, benefit, remaining))


def extend_to_other_strokes(shrinkage: Shrinkage, growth: Array, strokes: int) -> Shrinkage:
    """Return the shrinkage on strokes some of which are outside the recorded ranges (decision 0055).

    Args:
        shrinkage: shrinkage on strokes like the recorded ones.
        growth: growth of the remaining form error outside the recorded ranges, over the gap there, (draws,) [1].
        strokes: number of recorded strokes of different amplitude or frequency.
    """
    remaining = shrinkage.remaining
    if remaining is None:
        return shrinkage
    random = np.random.default_rng(0)
    # Of n + 1 strokes drawn alike, the last is outside the range of the others with the probability 2 / (n + 1).
    is_outside = random.random(_DRAWS) < 2.0 / (max(strokes, 1) + 1)
    factor = np.where(is_outside, random.choice(growth, _DRAWS), 1.0)
    grown = remaining._replace(form_error=_scale_odds(remaining.form_error, factor))
    return _summarise(replace(shrinkage, remaining=grown))


def estimate_shares(
    held_out: HeldOutErrors, after: float, noise: float
) -> dict[str, tuple[float, tuple[float, float]]]:
    """Estimate the part of the gap's variance that returns without each effect, with its 95 % interval.

    Args:
        held_out: errors of the held-out cycles.
        after: RMSE with all named effects that is expected of another run [N].
        noise: standard deviation of the noise in the recorded force [N].
    """
    random = np.random.default_rng(0)
    names = list(held_out.without)
    sums = np.stack([held_out.before, held_out.after, *(held_out.without[name] for name in names)])
    measured = sums.sum(axis=1) / held_out.counts.sum()
    drawn = _resample_cycles(sums, held_out.counts, held_out.segment, random)
    # Another run adds its input noise to the error of every set with effects. The law alone is compared as it was
    # measured, as in the shrinkage.
    expected = after**2 - measured[1] if len(names) == 1 else 0.0
    gap = max(measured[0] - noise**2, _MIN_GAP_SHARE * noise**2)
    gaps = np.maximum(drawn[0] - noise**2, _MIN_GAP_SHARE * noise**2)
    shares = {}
    for k, name in enumerate(names, 2):
        value = float((measured[k] - measured[1] - expected) / gap)
        low, high = np.quantile((drawn[k] - drawn[1] - expected) / gaps, [0.025, 0.975])
        shares[name] = (value, (min(float(low), value), max(float(high), value)))
    return shares


def _estimate_benefit(after: float, noise: float, replicates: Replicates) -> float:
    """Estimate the part [1] of the whole run's gap that the effects close if the run is repeated.

    ``after`` [N²] is the mean square on the held-out cycles, where an overfitted set does harm, without what slow
    noise on so few cycles can add by chance.
    """
    remaining = max(after - noise**2 - replicates.held_out, 0.0) + float(replicates.runs.mean())
    return 1.0 - remaining / max(replicates.before - noise**2, _MIN_GAP_SHARE * noise**2)


def _summarise(shrinkage: Shrinkage) -> Shrinkage:
    """Return the shrinkage with value, interval and expected error from what remains of the gap."""
    remaining = shrinkage.remaining
    if remaining is None:
        return shrinkage
    closed = 1.0 - remaining.form_error - remaining.input_noise
    value = float(closed.mean())
    low, high = np.quantile(closed, [0.025, 0.975])
    gap = shrinkage.before**2 - remaining.noise**2
    return replace(
        shrinkage,
        after=math.sqrt(remaining.noise**2 + (1.0 - value) * gap),
        value=value,
        ci95=(min(float(low), value), max(float(high), value)),
    )


def _sample_remaining_gap(errors: CycleErrors, noise: float, replicates: Replicates, strokes: int) -> RemainingGap:
    """Draw the parts of the gap that remain on other runs."""
    random = np.random.default_rng(0)
    before, after = _resample_cycles(np.stack(errors[:2]), errors.counts, errors.segment, random)
    gap = np.maximum(before - noise**2, _MIN_GAP_SHARE * noise**2)
    form_error = np.maximum(after - noise**2 - replicates.evaluated, 0.0) / gap
    deviation = _FORM_DEVIATION + _FEW_STROKES_DEVIATION / max(strokes, 1)
    form_error = _vary_part(form_error, deviation * random.standard_normal(_DRAWS))
    size = (replicates.before - noise**2) * np.exp(_GAP_DEVIATION * random.standard_normal(_DRAWS))
    input_noise = random.choice(replicates.runs, _DRAWS) / np.maximum(size, _MIN_GAP_SHARE * noise**2)
    return RemainingGap(form_error, input_noise, noise)


def _vary_part(part: Array, deviation: Array) -> Array:
    """Return parts of the gap [1] on other strokes, for deviations of their log odds.

    A part cannot exceed the whole. With a factor, a remaining third of the gap could become more than all of it. A
    part above one, where the effects harm, stays as it is. To first order the mean is kept for many strokes, which
    are a representative sample. For few strokes a small part is larger on average (decision 0014).
    """
    shift = 0.5 * _FORM_DEVIATION**2 * (1.0 - 2.0 * part)
    return _scale_odds(part, np.exp(deviation - shift))


def _scale_odds(part: Array, factor: Array) -> Array:
    """Multiply the odds of parts of the gap [1]; a part of one or more stays as it is."""
    return np.asarray(np.where(part < 1.0, part * factor / (1.0 + part * (factor - 1.0)), part))


def _resample_cycles(sums: Array, counts: Array, segment: Indices, random: np.random.Generator) -> Array:
    """Resample segments, then cycles; return mean squares [N²] of each row of sums (K, cycles), (K, draws)."""
    segments, index = np.unique(segment, return_inverse=True)
    members = [np.flatnonzero(index == k) for k in range(len(segments))]
    means = np.empty((len(sums), _DRAWS))
    for draw in range(_DRAWS):
        # Segments first: cycles of one condition are alike, and drawn alone would make the interval too narrow.
        chosen = random.integers(0, len(segments), len(segments))
        rows = np.concatenate([random.choice(members[k], len(members[k])) for k in chosen])
        means[:, draw] = sums[:, rows].sum(axis=1) / counts[rows].sum()
    return means

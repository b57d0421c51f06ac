"""The noise floor of the recorded force: what no model of the damper could ever explain.

Two witnesses. **Cycle to cycle**: where motion and drive repeat, the force of one cycle less that of the cycle
before holds twice the noise's variance, and no model is needed. **High frequency**: fourth differences see
only what is too swift for a damper; their middle is not moved by the knees of a hysteresis loop. They agree on
white noise. Where they do not, that is evidence: of drift, stick-slip, heating or coloured noise if the cycles
differ more, of hum locked to the stroke or too coarse sampling if they differ less.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from identification.arrays import Array, BoolArray
from identification.harmonics import steady_cycles
from identification.motion import Motion
from identification.recordings import Segment, Stretch
from identification.smoother import derivative, smoothed, stiffness

_SETTLING = 0.1
"""[s] after a change of motion or drive that is left out."""
_AGREE = 1.1
"""[1] ratio of the two witnesses up to which they are said to agree."""
_FEWEST = 200
"""[samples] of repeated cycles needed to speak of a floor."""
_FEWEST_ALIKE = 50
"""[samples] of two like cycles needed to compare them."""
_ALIKE = 2.0
"""[1] how much more than the best quarter of the cycles' motions may differ, and two still be said to repeat."""
_SAME = 2e-4
"""[1] of the displacement's deviation: what differs by less is the same motion."""
_CARRIES = 6.0
"""[1] multiple of the stroke's frequency up to which its motion may differ from cycle to cycle."""
_PERIODIC = ("sine", "triangle")


@dataclass(frozen=True)
class Floor:
    """Noise of a recorded force."""

    noise: float
    """[N] standard deviation; the figure to use."""
    cycle_to_cycle: float | None
    """[N] from repeated cycles; none where nothing repeats."""
    high_frequency: float
    """[N] from fourth differences."""
    how: str
    """How it was got, or why not otherwise, in words."""


class _Pairs(NamedTuple):
    """Samples (n,) of cycles, each less the one a cycle before."""

    force: Array
    """[N]"""
    motion: Array
    """(3, n) displacement [m], velocity [m/s] and acceleration [m/s²]."""
    velocity: Array
    """[m/s] itself, not its difference."""
    cycle: npt.NDArray[np.intp]
    """Which cycle each sample stands in."""
    other: Array
    """(cycles,) [m] by which the displacement of each differs from that of the one before."""
    share: float
    """[1] variance of a difference for white noise of variance 1."""


class _Repeats(NamedTuple):
    """What differs between repeated cycles."""

    squares: float
    """[N²] sum of squared noise."""
    freedom: float
    """[1] how many independent samples stand behind it."""
    cycles: int


def measure_floor(stretch: Stretch, motion: Motion) -> Floor:
    """Noise of the force of one stretch.

    Args:
        stretch: recorded force, drive and segments.
        motion: its motion, which says what of the force's change the stroke itself explains.

    Returns:
        The floor and how it was got. Noise of the displacement is no part of it.
    """
    swift = high_frequency_noise(stretch.force)
    periodic = [s for s in stretch.segments if s.motion in _PERIODIC and s.frequency]
    pairs = [p for s in periodic if (p := _pairs(stretch, motion, s)) is not None]
    limit = max(_as_alike_as(pairs), _SAME * float(np.std(stretch.displacement)))
    repeats = [_repeats(p, limit) for p in pairs]
    freedom = sum(r.freedom for r in repeats)
    if freedom < _FEWEST:
        return Floor(swift, None, swift, f"high frequency: {_why_not(stretch, freedom)}")
    repeated = math.sqrt(sum(r.squares for r in repeats) / freedom)
    noise, verdict = _weighed(repeated, swift)
    cycles = sum(r.cycles for r in repeats)
    return Floor(noise, repeated, swift, f"cycle to cycle over {cycles} cycles; {verdict}")


def combine_floors(stretches: Sequence[Stretch], floors: Sequence[Floor]) -> Floor:
    """One floor for several stretches, each weighted by its samples.

    Args:
        stretches: as measured.
        floors: of each of them.

    Returns:
        The common floor.
    """
    counts = np.array([np.count_nonzero(s.measured) for s in stretches], float)
    repeated = np.array([np.nan if f.cycle_to_cycle is None else f.cycle_to_cycle for f in floors])
    known = np.isfinite(repeated)
    together = _mean(repeated[known], counts[known]) if known.any() else None
    return Floor(
        _mean(np.array([f.noise for f in floors]), counts),
        together,
        _mean(np.array([f.high_frequency for f in floors]), counts),
        floors[0].how if len(floors) == 1 else _summary(floors),
    )


def high_frequency_noise(force: Array) -> float:
    """Standard deviation [N] of the white noise in a force (N,), by the middle of its fourth differences.

    A channel's own filter does not shape this noise: it is added where the force is digitised. The force is
    dithered by half a digit first, because the middle of a few coarse steps would be a coarse figure.
    """
    levels = np.unique(np.abs(np.diff(force)))
    digit = float(np.min(levels[levels > 1e-9 * np.ptp(force)], initial=np.ptp(force)))
    dither = digit * (np.random.default_rng(0).random(len(force)) - 0.5)
    middle = float(np.median(np.abs(np.diff(force + dither, 4)))) / 0.6744898 / math.sqrt(70.0)
    return math.sqrt(max(middle**2 - digit**2 / 12.0, 0.0)) if digit < middle * 10.0 else middle


def _weighed(repeated: float, swift: float) -> tuple[float, str]:
    """The figure to use [N], and what the two witnesses say together."""
    ratio = 1.0 if repeated == swift else repeated / max(swift, 1e-12)
    if 1.0 / _AGREE <= ratio <= _AGREE:
        return math.sqrt(repeated * swift), "the high-frequency floor agrees"
    if ratio > 1.0:
        return (
            repeated,
            f"{ratio:.2f} times the high-frequency floor: not all repeats, or the noise is coloured",
        )
    return repeated, f"only {ratio:.2f} of the high-frequency floor: swift force repeats with the stroke"


def _why_not(stretch: Stretch, freedom: float) -> str:
    if not any(s.motion in _PERIODIC for s in stretch.segments):
        return "no periodic motion, so that no cycle repeats"
    if freedom <= 0:
        return "no two cycles with the same steady motion and drive"
    return f"only {freedom:.0f} samples stand in repeated cycles"


def _summary(floors: Sequence[Floor]) -> str:
    """In how many stretches which witness spoke."""
    repeated = [f for f in floors if f.cycle_to_cycle is not None]
    if not repeated:
        return floors[0].how
    differ = [f for f in repeated if "agrees" not in f.how]
    words = f"cycle to cycle in {len(repeated)} of {len(floors)} stretches"
    if len(repeated) < len(floors):
        words += ", high frequency in the others"
    if differ:
        words += f"; the two differ by more than {_AGREE - 1:.0%} in {len(differ)}"
    return words


def _mean(noise: Array, counts: Array) -> float:
    return float(np.sqrt(np.sum(noise**2 * counts) / np.sum(counts)))


def _pairs(stretch: Stretch, motion: Motion, segment: Segment) -> _Pairs | None:
    """Each cycle of a segment beside the one before; none where the motion or the drive is never the same."""
    part = slice(segment.start, segment.stop)
    weights = stretch.measured[part].astype(float)
    frequency = segment.frequency or 0.0
    cycles = steady_cycles(motion.displacement[part], weights, stretch.rate, frequency, motion.noise)
    if cycles is None:
        return None
    achieved_frequency = cycles.frequency
    steady = slice(segment.start + cycles.start, segment.start + cycles.stop)
    lag = stretch.rate / achieved_frequency
    difference, share = _cycle_difference(stretch.force[steady], lag)
    achieved = _achieved(stretch, steady, achieved_frequency)
    explained = np.stack([_cycle_difference(x, lag)[0] for x in achieved])
    alike = _alike(stretch.drive[steady], stretch.measured[steady], lag, stretch.rate)
    if np.count_nonzero(alike) < _FEWEST_ALIKE:
        return None
    cycle = np.unique((np.arange(len(difference)) / lag).astype(int)[alike], return_inverse=True)[1]
    other = np.sqrt(np.bincount(cycle, explained[0, alike] ** 2) / np.bincount(cycle))
    velocity = achieved[1][-len(difference) :]
    return _Pairs(difference[alike], explained[:, alike], velocity[alike], cycle, other, share)


def _as_alike_as(pairs: Sequence[_Pairs]) -> float:
    """[m] by which the motion of two cycles may differ: where the rod stumbled once, force differs with it.

    A force that is steep over some micrometres is not explained by terms that are linear in the difference.
    """
    others = [p.other for p in pairs]
    return _ALIKE * float(np.quantile(np.concatenate(others), 0.25)) if others else 0.0


def _repeats(pairs: _Pairs, limit: float) -> _Repeats:
    """What differs between the cycles whose motion differs by at most a limit [m]."""
    kept = (pairs.other <= limit)[pairs.cycle]
    if np.count_nonzero(kept) < _FEWEST_ALIKE:
        return _Repeats(0.0, 0.0, 0)
    cycle = pairs.cycle[kept]
    rest, freedom = _left_over(pairs.force[kept], _loads(pairs.motion[:, kept], pairs.velocity[kept]), cycle)
    return _Repeats(float(rest @ rest) / pairs.share, freedom, len(np.unique(cycle)))


def _achieved(stretch: Stretch, steady: slice, frequency: float) -> tuple[Array, Array, Array]:
    """Displacement, velocity and acceleration up to some harmonics, from the displacement alone.

    The estimated motion may carry a trace of the force's own noise, which would explain itself away here.
    """
    x = stretch.displacement[steady]
    penalty = np.full(len(x) - 3, float(stiffness(min(_CARRIES * frequency, 0.2 * stretch.rate), stretch.rate)))
    x = smoothed(x, stretch.measured[steady].astype(float), penalty, np.zeros(len(x) - 3))
    velocity = derivative(x, stretch.rate)
    return x, velocity, derivative(velocity, stretch.rate)


def _cycle_difference(values: Array, lag: float) -> tuple[Array, float]:
    """Each sample less the one a cycle before, and the variance of that for white noise of variance 1.

    Args:
        values: (N,).
        lag: samples a cycle, not necessarily whole; between samples a cubic stands in, which averages noise.

    Returns:
        (N - n,) differences of the last samples, and the variance.
    """
    whole = math.floor(lag)
    t = lag - whole
    weights = np.array(
        [
            (t + 1.0) * t * (t - 1.0) / 6.0,
            -(t + 1.0) * t * (t - 2.0) / 2.0,
            (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
            -t * (t - 1.0) * (t - 2.0) / 6.0,
        ]
    )
    before = np.convolve(values, weights[::-1], "valid")
    skip = whole + 2
    return values[skip:] - before[: len(values) - skip], float(1.0 + weights @ weights)


def _alike(drive: Array, measured: BoolArray, lag: float, rate: float) -> BoolArray:
    """Samples, counted as cycle differences are, whose drive and its recent past are those of a cycle before."""
    skip, settling = math.floor(lag) + 2, math.ceil(_SETTLING * rate)
    whole = round(lag)
    steps = np.diff(drive)
    noise = float(np.median(np.abs(steps - np.median(steps)))) / 0.6745 / math.sqrt(2.0)
    other = np.abs(drive[skip:] - drive[skip - whole : len(drive) - whole]) > max(
        6.0 * noise, 2e-3 * np.ptp(drive)
    )
    other |= ~measured[skip:] | ~measured[skip - whole : len(drive) - whole]
    other[:settling] = True
    since = np.convolve(other, np.ones(settling + 1), "full")[: len(other)]
    return np.asarray(since < 0.5)


def _loads(differences: Array, velocity: Array) -> Array:
    """(6, n) differences of displacement, velocity and acceleration, everywhere and near the reversals."""
    slow = np.exp(-((velocity / (0.1 * np.std(velocity) + 1e-12)) ** 2))
    scaled = differences / (np.std(differences, axis=1, keepdims=True) + 1e-12)
    return np.concatenate([scaled, scaled * slow])


def _left_over(difference: Array, terms: Array, cycle: npt.NDArray[np.intp]) -> tuple[Array, float]:
    """What remains without the cycles' means and the terms, and its degrees of freedom."""
    names, cycle = np.unique(cycle, return_inverse=True)
    counts = np.bincount(cycle)

    def centred(values: Array) -> Array:
        return np.asarray(values - (np.bincount(cycle, values) / counts)[cycle])

    difference = centred(difference)
    terms = np.stack([centred(term) for term in terms])
    amplitudes = np.linalg.lstsq(terms @ terms.T, terms @ difference, rcond=1e-9)[0]
    return difference - amplitudes @ terms, float(len(difference) - len(names) - len(terms))

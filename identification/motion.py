"""Displacement, velocity and acceleration of a stretch, from a displacement with noise and steps.

Velocity enters the force through c0, so that noise of the displacement becomes noise of the force: a plain
difference of 2 µm noise at 1 kHz is 2.8 mm/s, at 2000 N s/m some 6 N. What is known of the motion is used in turn:

1. The actuator gives way under the load. What the displacement follows of the recorded force is regressed on
   the force at lags of -6 to 45 ms, if it is there at all.
2. A periodic segment repeats: its harmonics are fitted (harmonics.py).
3. The rest is smoothed (smoother.py): the third differences of the motion are expected to be those of 1 and 2.
   How stiffly is chosen place by place (each periodic segment, the joints, everything else) where the estimated
   error of the *velocity* is least (Mallows' Cp of the first differences).
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from identification.arrays import Array, BoolArray
from identification.harmonics import Harmonics, fit_harmonics
from identification.recordings import Stretch
from identification.smoother import derivative, kept_noise, smoothed, stiffness

Indices = npt.NDArray[np.intp]

_PERIODIC = ("sine", "triangle")
_JOINT = 0.06
"""[s] Around the ends of what is known of the motion, transients are left room."""
_CUTOFF_RATIO = 1.35
_LOWEST, _HIGHEST = 0.003, 0.25
"""Of the trial cutoffs, in cycles a sample."""
_STROKE_BAND = 200.0
"""[Hz] No hydraulic or electric stroke carries more; what a sensor shows above it is noise of any colour."""
_END = 2.0
"""How much looser the smoother is at an end of the stretch."""
_LAGS = np.arange(-0.006, 0.0451, 0.003)
"""[s] At which the displacement may follow the force."""
_CHANCE = 4.0
"""The force explains the displacement if it does so this many times better than chance."""


class Motion(NamedTuple):
    """The motion of a stretch, (N,) each; velocity and acceleration are the displacement's derivatives."""

    displacement: Array
    """[m]"""
    velocity: Array
    """[m/s]"""
    acceleration: Array
    """[m/s²]"""
    noise: float
    """Standard deviation of the noise of the recorded displacement [m]."""
    method: tuple[str, ...]
    """How it was got, in words, one statement a segment; one for all where there are no segments."""


def estimate_motion(stretch: Stretch) -> Motion:
    """The motion behind the recorded displacement of a stretch.

    Args:
        stretch: with the segments of its method, as far as they are known.

    Returns:
        The motion on the stretch's own time base.
    """
    weights = stretch.measured.astype(float)
    noise = displacement_noise(stretch.displacement, stretch.measured)
    give = _give_under_load(stretch, weights, noise)
    waves = _periodic_parts(stretch, weights, give, noise)
    regions = _regions(len(weights), waves, stretch.rate, bool(np.any(give)))
    expected = _expected(give, waves, int(_LAGS[-1] * stretch.rate))
    cutoffs = _cutoffs(stretch.displacement, weights, expected, regions, stretch.rate, noise)
    penalty = stiffness(_looser_at_the_ends(cutoffs[regions], stretch.rate)[1:-2], stretch.rate)
    displacement = smoothed(stretch.displacement, weights, penalty, expected)
    velocity, from_record = _better_velocity(stretch, displacement)
    rest = (stretch.displacement - displacement)[stretch.measured]
    return Motion(
        displacement,
        velocity,
        derivative(velocity, stretch.rate),
        float(np.std(rest)),
        _in_words(stretch, waves, cutoffs, bool(np.any(give)), from_record),
    )


def displacement_noise(displacement: Array, measured: BoolArray) -> float:
    """Standard deviation [m] of white noise or quantisation in a displacement (N,), by its fourth differences.

    The largest hundredth of them (knocks) is left out, and put back as a Gaussian would have it.
    """
    whole = np.convolve(measured, np.ones(5), "valid") > 4.5
    squares = np.diff(displacement, 4)[whole] ** 2 / 70.0
    usual = squares[squares <= np.quantile(squares, 0.99)]
    return float(np.sqrt(np.mean(usual) / 0.92476))


def _give_under_load(stretch: Stretch, weights: Array, noise: float) -> Array:
    """What the displacement follows of the force (N,) [m]; zeros where it follows nothing."""
    x, rate = stretch.displacement, stretch.rate
    nothing = np.zeros(len(x))
    if len(x) < 50 * len(_LAGS):
        return nothing
    everywhere = np.zeros(len(x), int)
    cutoff = _cutoffs(x, weights, nothing[3:], everywhere, rate, noise)[0]
    penalty = np.full(len(x) - 3, float(stiffness(cutoff, rate)))
    shifts = np.unique(np.rint(_LAGS * rate).astype(int))
    reach = int(np.max(np.abs(shifts))) + 1
    force = _blurred(stretch.force, int(shifts[1] - shifts[0]))
    swift = (x - smoothed(x, weights, penalty, nothing[3:])) * weights
    driver = force - smoothed(force, np.ones(len(x)), penalty, nothing[3:])
    rows = np.arange(reach, len(x) - reach, max(1, len(x) // 100_000))
    lagged = np.stack([driver[rows - shift] for shift in shifts])
    normal, right = lagged @ lagged.T, lagged @ swift[rows]
    gains = np.linalg.lstsq(normal, right, rcond=1e-10)[0]
    explained, left = float(gains @ right), float(np.sum(swift[rows] ** 2))
    if explained < _CHANCE * len(shifts) * left / len(rows):
        return nothing
    padded = np.pad(force, reach, "edge")
    kernel = np.zeros(2 * reach + 1)
    kernel[reach + shifts] = gains
    return np.convolve(padded, kernel, "valid")


def _blurred(values: Array, width: int) -> Array:
    """The signal under a triangle of twice this many samples: what stands between two lags is not lost."""
    hat = width - np.abs(np.arange(1 - width, width))
    return np.convolve(np.pad(values, width - 1, "edge"), hat / width**2, "valid")


def _periodic_parts(stretch: Stretch, weights: Array, give: Array, noise: float) -> list[Harmonics]:
    """The harmonics of every segment that repeats, with their places in the stretch."""
    parts = []
    for segment in stretch.segments:
        if segment.motion not in _PERIODIC or not segment.frequency:
            continue
        part = slice(segment.start, segment.stop)
        left = stretch.displacement[part] - give[part]
        wave = fit_harmonics(left, weights[part], stretch.rate, segment.frequency, noise)
        if wave is not None:
            parts.append(wave._replace(start=wave.start + segment.start, stop=wave.stop + segment.start))
    return parts


def _regions(count: int, waves: list[Harmonics], rate: float, gives: bool) -> Indices:
    """(N,) what each sample belongs to: 0 nothing known, 1 joint, 2 and on a periodic part."""
    regions = np.zeros(count, int)
    reach = int(_JOINT * rate) + 1
    for k, wave in enumerate(waves):
        regions[wave.start : wave.stop] = 2 + k
    edges = {edge for wave in waves for edge in (wave.start, wave.stop)} - {0, count}
    for edge in edges | ({0, count} if gives else set()):
        regions[max(edge - reach, 0) : edge + reach] = 1
    return regions


def _expected(give: Array, waves: list[Harmonics], unknown: int) -> Array:
    """(N-3,) third differences [m] that what is known lets one expect; the force before the start is not."""
    expected = np.diff(give, 3)
    expected[:unknown] = expected[len(expected) - unknown :] = 0.0
    for wave in waves:
        expected[wave.start : wave.stop - 3] += np.diff(wave.values, 3)
    return expected


def _cutoffs(values: Array, weights: Array, expected: Array, regions: Indices, rate: float, noise: float) -> Array:
    """The cutoff [Hz] for each region that makes the estimated error of the velocity least."""
    highest = max(min(_HIGHEST * rate, _STROKE_BAND), 2.0 * _LOWEST * rate)
    count = int(np.log(highest / (_LOWEST * rate)) / np.log(_CUTOFF_RATIO)) + 1
    trials = np.geomspace(highest, _LOWEST * rate, count + 1)[::-1]
    both = weights[1:] * weights[:-1]
    sizes = np.bincount(regions[1:], both)
    costs = np.empty((len(trials), len(sizes)))
    for cost, cutoff in zip(costs, trials, strict=True):
        penalty = np.full(len(expected), float(stiffness(cutoff, rate)))
        left = np.diff(values - smoothed(values, weights, penalty, expected)) ** 2
        cost[:] = np.bincount(regions[1:], both * left) + 2.0 * noise**2 * sizes * kept_noise(cutoff, rate)
    return np.asarray(trials[np.argmin(costs, axis=0)])


def _looser_at_the_ends(cutoffs: Array, rate: float) -> Array:
    """The cutoffs (N,) raised towards the ends, where a stiff smoother would bend the motion straight."""
    place = np.arange(len(cutoffs)) / rate
    to_end = np.minimum(place, place[-1] - place)
    return np.asarray(cutoffs * (1.0 + (_END - 1.0) * np.clip(1.0 - to_end * cutoffs, 0.0, 1.0)))


def _better_velocity(stretch: Stretch, displacement: Array) -> tuple[Array, bool]:
    """The recorded velocity if the force follows it at least as well as the derivative; and whether it does."""
    derived = derivative(displacement, stretch.rate)
    if stretch.velocity is None:
        return derived, False
    recorded_wins = _unexplained(stretch, displacement, stretch.velocity) <= _unexplained(
        stretch, displacement, derived
    )
    return (stretch.velocity if recorded_wins else derived), recorded_wins


def _unexplained(stretch: Stretch, displacement: Array, velocity: Array) -> float:
    """What a plain damper without memory (springs, dashpots, two yields) leaves of the force [N²].

    A velocity with more noise, or one that was filtered more, leaves more.
    """
    typical = float(np.std(velocity[stretch.measured])) or 1.0
    dashpots = [velocity, np.tanh(velocity / (0.1 * typical)), np.tanh(velocity / (0.5 * typical))]
    terms = np.stack(
        [
            np.ones_like(velocity),
            stretch.drive,
            displacement,
            *dashpots,
            *(term * stretch.drive for term in dashpots),
        ]
    )[:, stretch.measured]
    force = stretch.force[stretch.measured]
    amplitudes = np.linalg.lstsq(terms @ terms.T, terms @ force, rcond=1e-12)[0]
    return float(np.mean((force - amplitudes @ terms) ** 2))


def _in_words(
    stretch: Stretch, waves: list[Harmonics], cutoffs: Array, gives: bool, from_record: bool
) -> tuple[str, ...]:
    """How the motion of each segment was got."""
    load = ", what follows the force" if gives else ""
    load += "; velocity as recorded" if from_record else ""
    rest = f"smoothed below {cutoffs[0]:.3g} Hz{load}"
    words = []
    for segment in stretch.segments:
        mine = [k for k, wave in enumerate(waves) if segment.start <= wave.start < segment.stop]
        for k in mine:
            orders = ", ".join(str(order) for order in waves[k].orders)
            words.append(
                f"{waves[k].frequency:.5g} Hz with harmonics {orders}{load}, "
                f"the rest below {cutoffs[2 + k]:.3g} Hz"
            )
        if not mine:
            words.append(rest)
    return tuple(words) or (rest,)

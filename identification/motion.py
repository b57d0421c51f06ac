"""Displacement, velocity and acceleration of a stretch, from a displacement with noise and steps.

Velocity enters the force through c0, so that noise of the displacement becomes noise of the force: a plain
difference of 2 µm noise at 1 kHz is 2.8 mm/s, at 2000 N s/m some 6 N. What is known of the motion is used in turn:

1. The actuator gives way under the load. What the displacement follows of the recorded force is regressed on
   the force at lags of -6 to 45 ms, if it is there at all (actuator_give.py).
2. A periodic stroke repeats: its harmonics are fitted (harmonics.py), over all segments that it goes on through.
3. The rest is smoothed twice (smoother.py): the third differences of the motion are expected to be those of 1
   and 2. How stiffly is chosen place by place (each periodic segment, each stretch between them, the joints) where
   the estimated error of the *velocity* is least (cutoffs.py). A fade, a move and a hold
   are not alike: one stiffness for all of them bends the fades by micrometres, and k0 and k1 with them.
"""

from functools import partial
from typing import NamedTuple

import numpy as np

from identification.actuator_give import LONGEST_LAG, give_under_load
from identification.arrays import Array, BoolArray
from identification.cutoffs import best_cutoffs
from identification.harmonics import Harmonics, fit_harmonics, steady_cycles
from identification.motion_parts import divide, marked, stumbles
from identification.recordings import Segment, Stretch
from identification.smoother import derivative, smoothed, stiffness

_PERIODIC = ("sine", "triangle")
_LONGEST_RUN = 30.0
"""[s] Segments of one stroke are fitted together up to this length; longer ones average enough by themselves."""
_WHOLE_RUN = 0.9
"""[1] share of a run that must be steady, else its segments are fitted one by one."""
_END = 1.5
"""How much looser the smoother is at an end of the stretch: with 2, noise there is up to half as much again."""
_USUAL, _LEFT = 0.99, 0.92476
"""[1] part of the fourth differences that is not a knock, and mean square of that part of a Gaussian's."""


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
    cutoff: Array
    """Of the smoother at each sample [Hz]."""
    lost: BoolArray
    """True where the rod stumbled so far off its wave that nobody knows how it moved from sample to sample."""
    method: tuple[str, ...]
    """How it was got, in words, one statement a segment; one for all where there are no segments."""


def estimate_motion(stretch: Stretch, cutoff: Array | None = None) -> Motion:
    """The motion behind the recorded displacement of a stretch.

    Args:
        stretch: with the segments of its method, as far as they are known.
        cutoff: (N,) of the smoother [Hz], where it is known already.

    Returns:
        The motion on the stretch's own time base.
    """
    weights = stretch.measured.astype(float)
    noise = recorded_noise(stretch)
    # A stumble hides from the regression what gives way under the load, so it is looked for first (decision 0013).
    stumbled = _roughly_stumbled(stretch, weights, noise)
    give = give_under_load(stretch, np.where(stumbled, 0.0, weights), noise)
    gives = bool(np.any(give))
    waves = _periodic_parts(stretch, weights, give, noise)
    parts = divide(stretch, waves, gives)
    expected = _expected(give, waves, int(LONGEST_LAG * stretch.rate))
    if cutoff is None:
        trial = partial(best_cutoffs, expected=expected, regions=parts.regions, rate=stretch.rate, noise=noise)
        cutoff = trial(stretch.displacement, weights, twice=True)[parts.regions]
        if parts.stumbled.any():
            # Beside a stumble, what a stiff smoother makes of that is no fault of the motion there.
            calm = trial(stretch.displacement, np.where(parts.stumbled, 0.0, weights), twice=True)
            cutoff = np.where(parts.stumbled, cutoff, calm[parts.regions])
    # A third difference spans four samples; its cutoff is that of the second.
    penalty = stiffness(_looser_at_the_ends(cutoff, stretch.rate)[1:-2], stretch.rate)
    displacement = smoothed(stretch.displacement, weights, penalty, expected, twice=True)
    velocity, from_record = _better_velocity(stretch, displacement)
    rest = (stretch.displacement - displacement)[stretch.measured]
    return Motion(
        displacement,
        velocity,
        derivative(velocity, stretch.rate),
        float(np.std(rest)),
        cutoff,
        parts.lost,
        _in_words(stretch, waves, cutoff, gives, from_record),
    )


def recorded_noise(stretch: Stretch) -> float:
    """Standard deviation [m] of white noise or quantisation in the displacement of a stretch.

    Half-way between two samples a cubic passes nothing of the fastest noise: the differences of neighbours show
    less than half of white noise there (0.44), those of every other sample nearly all (0.87).
    """
    return displacement_noise(stretch.displacement, stretch.measured, 2 if stretch.interpolated else 1)


def displacement_noise(displacement: Array, measured: BoolArray, stride: int = 1) -> float:
    """Standard deviation [m] of white noise or quantisation in a displacement (N,), by its fourth differences.

    The largest hundredth of them (knocks) is left out, and put back as a Gaussian would have it. They are taken
    over samples that lie ``stride`` apart.
    """
    apart = [slice(k * stride, len(displacement) - (4 - k) * stride) for k in range(5)]
    # 70 = 1 + 16 + 36 + 16 + 1: variance of the fourth difference of white noise.
    whole = np.all([measured[part] for part in apart], axis=0)
    fourth = np.sum([c * displacement[part] for c, part in zip((1, -4, 6, -4, 1), apart, strict=True)], axis=0)
    squares = fourth[whole] ** 2 / 70.0
    usual = squares[squares <= np.quantile(squares, _USUAL)]
    return float(np.sqrt(np.mean(usual) / _LEFT))


def _roughly_stumbled(stretch: Stretch, weights: Array, noise: float) -> BoolArray:
    """(N,) True where a periodic stroke stumbled, at a first look."""
    off = np.zeros(len(weights))
    for run in _runs(stretch):
        part, frequency = slice(run[0].start, run[-1].stop), run[0].frequency or 0.0
        steady = steady_cycles(stretch.displacement[part], weights[part], stretch.rate, frequency, noise)
        if steady:
            off[part] = steady.off
    return marked(stumbles(stretch, off), len(off))


def _periodic_parts(stretch: Stretch, weights: Array, give: Array, noise: float) -> list[Harmonics]:
    """The harmonics of every segment that repeats, with their places in the stretch."""
    left = stretch.displacement - give
    parts = []
    for run in _runs(stretch):
        whole = _wave(left, weights, stretch.rate, run, noise)
        if len(run) > 1 and whole is not None and _length(whole) > _WHOLE_RUN * (run[-1].stop - run[0].start):
            parts += [_cut(whole, segment) for segment in run if _overlap(whole, segment) > 0]
        else:
            waves = [whole] if len(run) == 1 else [_wave(left, weights, stretch.rate, (s,), noise) for s in run]
            parts += [wave for wave in waves if wave is not None]
    return parts


def _runs(stretch: Stretch) -> list[tuple[Segment, ...]]:
    """Periodic segments through which one stroke goes on without a stop, while the drive changes."""
    runs: list[tuple[Segment, ...]] = []
    for segment in stretch.segments:
        if segment.motion not in _PERIODIC or not segment.frequency:
            continue
        if runs and _goes_on(runs[-1], segment, stretch.rate):
            runs[-1] = (*runs[-1], segment)
        else:
            runs.append((segment,))
    return runs


def _goes_on(run: tuple[Segment, ...], segment: Segment, rate: float) -> bool:
    last = run[-1]
    same = (last.motion, last.amplitude, last.frequency) == (segment.motion, segment.amplitude, segment.frequency)
    return same and segment.start - last.stop <= 1 and segment.stop - run[0].start <= _LONGEST_RUN * rate


def _wave(values: Array, weights: Array, rate: float, run: tuple[Segment, ...], noise: float) -> Harmonics | None:
    """The harmonics of a run, with their place in the stretch; None where too little of it is steady."""
    start, part = run[0].start, slice(run[0].start, run[-1].stop)
    wave = fit_harmonics(values[part], weights[part], rate, run[0].frequency or 0.0, noise)
    return wave and wave._replace(start=wave.start + start, stop=wave.stop + start)


def _length(wave: Harmonics) -> int:
    return wave.stop - wave.start


def _overlap(wave: Harmonics, segment: Segment) -> int:
    return min(wave.stop, segment.stop) - max(wave.start, segment.start)


def _cut(wave: Harmonics, segment: Segment) -> Harmonics:
    """The part of a run's harmonics that lies in one of its segments."""
    start, stop = max(wave.start, segment.start), min(wave.stop, segment.stop)
    part = slice(start - wave.start, stop - wave.start)
    return wave._replace(start=start, stop=stop, values=wave.values[part], off=wave.off[part])


def _expected(give: Array, waves: list[Harmonics], unknown: int) -> Array:
    """(N-3,) third differences [m] that what is known lets one expect; the force before the start is not."""
    expected = np.diff(give, 3)
    # There the lags reach beyond the recorded force.
    expected[:unknown] = expected[len(expected) - unknown :] = 0.0
    for wave in waves:
        expected[wave.start : wave.stop - 3] += np.diff(wave.values, 3)
    return expected


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
    stretch: Stretch, waves: list[Harmonics], cutoff: Array, gives: bool, from_record: bool
) -> tuple[str, ...]:
    """How the motion of each segment was got."""
    load = ", what follows the force" if gives else ""
    load += "; velocity as recorded" if from_record else ""
    words = []
    for segment in stretch.segments:
        mine = [wave for wave in waves if segment.start <= wave.start < segment.stop]
        for wave in mine:
            orders = ", ".join(str(order) for order in wave.orders)
            below = cutoff[(wave.start + wave.stop) // 2]
            words.append(f"{wave.frequency:.5g} Hz with harmonics {orders}{load}, the rest below {below:.3g} Hz")
        if not mine:
            words.append(f"smoothed below {cutoff[(segment.start + segment.stop) // 2]:.3g} Hz{load}")
    return tuple(words) or (f"smoothed below {cutoff[len(cutoff) // 2]:.3g} Hz{load}",)

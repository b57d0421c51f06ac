"""Displacement, velocity and acceleration of a stretch, from a displacement with noise and steps.

Velocity enters the force through c0, so that noise of the displacement becomes noise of the force: a plain
difference of 2 µm noise at 1 kHz is 2.8 mm/s, at 2000 N s/m some 6 N. What is known of the motion is used in turn:

1. The actuator gives way under the load. What the displacement follows of the recorded force is regressed on
   the force at lags of -6 to 45 ms, if it is there at all.
2. A periodic stroke repeats: its harmonics are fitted (harmonics.py), over all segments that it goes on through.
3. The rest is smoothed twice (smoother.py): the third differences of the motion are expected to be those of 1
   and 2. How stiffly is chosen place by place (each periodic segment, each stretch between them, the joints) where
   the estimated error of the *velocity* is least (Mallows' Cp of the first differences). A fade, a move and a hold
   are not alike: one stiffness for all of them bends the fades by micrometres, and k0 and k1 with them.
"""

from functools import partial
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.ndimage import minimum_filter1d

from identification.arrays import Array, BoolArray
from identification.harmonics import Harmonics, fit_harmonics, steady_cycles
from identification.motion_parts import MOST_GIVE, divide, marked, stumbles
from identification.recordings import Segment, Stretch
from identification.smoother import derivative, kept_noise, smoothed, stiffness

Indices = npt.NDArray[np.intp]

_PERIODIC = ("sine", "triangle")
_LONGEST_RUN = 30.0
"""[s] Segments of one stroke are fitted together up to this length; longer ones average enough by themselves."""
_WHOLE_RUN = 0.9
"""[1] share of a run that must be steady, else its segments are fitted one by one."""
_CUTOFF_RATIO = 1.35
_LOWEST, _HIGHEST = 0.003, 0.25
"""Of the trial cutoffs, in cycles a sample."""
_STROKE_BAND = 200.0
"""[Hz] No hydraulic or electric stroke carries more; what a sensor shows above it is noise of any colour."""
_END = 2.0
"""How much looser the smoother is at an end of the stretch."""
_LAGS = np.arange(-0.006, 0.0451, 0.003)
"""[s] At which the displacement may follow the force."""
_BLOCK = 2.0
"""[s] length of the blocks of which the middle one's cutoff is taken."""
_CALM = 3.0
"""[1] deviations of the noise within which nine tenths of what is swift must stay, or it is the stroke."""
_KNOCK = 4.0
"""[1] What stands out so many times over most is a knock of the actuator and follows no force."""
_ROUNDS = 3
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
    stumbled = _roughly_stumbled(stretch, weights, noise)
    give = _give_under_load(stretch, np.where(stumbled, 0.0, weights), noise)
    waves = _periodic_parts(stretch, weights, give, noise)
    parts = divide(stretch, waves, bool(np.any(give)))
    expected = _expected(give, waves, int(_LAGS[-1] * stretch.rate))
    if cutoff is None:
        trial = partial(_cutoffs, expected=expected, regions=parts.regions, rate=stretch.rate, noise=noise)
        cutoff = trial(stretch.displacement, weights, twice=True)[parts.regions]
        if parts.stumbled.any():
            # Beside a stumble, what a stiff smoother makes of that is no fault of the motion there.
            calm = trial(stretch.displacement, np.where(parts.stumbled, 0.0, weights), twice=True)
            cutoff = np.where(parts.stumbled, cutoff, calm[parts.regions])
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
        _in_words(stretch, waves, cutoff, bool(np.any(give)), from_record),
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
    whole = np.all([measured[part] for part in apart], axis=0)
    fourth = np.sum([c * displacement[part] for c, part in zip((1, -4, 6, -4, 1), apart, strict=True)], axis=0)
    squares = fourth[whole] ** 2 / 70.0
    usual = squares[squares <= np.quantile(squares, 0.99)]
    return float(np.sqrt(np.mean(usual) / 0.92476))


def _roughly_stumbled(stretch: Stretch, weights: Array, noise: float) -> BoolArray:
    """(N,) True where a periodic stroke stumbled, at a first look."""
    off = np.zeros(len(weights))
    for run in _runs(stretch):
        part, frequency = slice(run[0].start, run[-1].stop), run[0].frequency or 0.0
        steady = steady_cycles(stretch.displacement[part], weights[part], stretch.rate, frequency, noise)
        if steady:
            off[part] = steady.off
    return marked(stumbles(stretch, off), len(off))


def _give_under_load(stretch: Stretch, weights: Array, noise: float) -> Array:
    """What the displacement follows of the force (N,) [m]; zeros where it follows nothing."""
    x, rate = stretch.displacement, stretch.rate
    nothing = np.zeros(len(x))
    if len(x) < 50 * len(_LAGS):
        return nothing
    cutoff = _calm_cutoff(x, weights, rate, noise)
    penalty = np.full(len(x) - 3, float(stiffness(cutoff, rate)))
    shifts = np.unique(np.rint(_LAGS * rate).astype(int))
    reach = int(np.max(np.abs(shifts))) + 1
    force = _blurred(stretch.force, int(shifts[1] - shifts[0]))
    swift = (x - smoothed(x, weights, penalty, nothing[3:])) * weights
    driver = force - smoothed(force, np.ones(len(x)), penalty, nothing[3:])
    rows = np.arange(reach, len(x) - reach, max(1, len(x) // 100_000))
    rows = rows[minimum_filter1d(weights, 2 * reach + 1)[rows] > 0.0]
    lagged = np.stack([driver[rows - shift] for shift in shifts])
    gains, chance = _followed(lagged, swift[rows], reach)
    if chance < _CHANCE:
        return nothing
    kernel = np.zeros(2 * reach + 1)
    kernel[reach + shifts] = gains
    give = np.convolve(np.pad(force, reach, "edge"), kernel, "valid")
    if np.std(give) < MOST_GIVE * np.std(x):
        return give
    # Of the slow part of the force too little was learnt; the smoother follows what it does.
    return np.convolve(np.pad(driver, reach, "edge"), kernel, "valid")


def _calm_cutoff(values: Array, weights: Array, rate: float, noise: float) -> float:
    """The cutoff [Hz] above which a displacement (N,) shows noise, and what it follows of the force."""

    def middle(block: float) -> float:
        blocks = (np.arange(len(values)) / block).astype(np.intp)
        cutoffs = _cutoffs(values, weights, np.zeros(len(values) - 3), blocks, rate, noise)
        return float(np.quantile(cutoffs, 0.5, method="lower"))

    if not weights.all():
        # Where the rod stumbled, small stumbles are left: they raise the cutoff of the whole, not of most blocks.
        cutoff = middle(_BLOCK * rate)
        penalty = np.full(len(values) - 3, float(stiffness(cutoff, rate)))
        swift = np.abs(values - smoothed(values, weights, penalty, np.zeros(len(penalty))))[weights > 0.0]
        if np.quantile(swift, 0.9) < _CALM * noise:
            return cutoff
    return middle(len(values))


def _followed(lagged: Array, swift: Array, reach: int) -> tuple[Array, float]:
    """Gains [m/N] of each lag on a displacement (rows,) [m], and how much better than chance they explain it [1].

    A knock moves rod and force by itself. It is known by what no gain explains, and what lies around it by then
    tells nothing of the actuator either.
    """
    rest, sound = swift, np.ones(len(swift), bool)
    for round_ in range(_ROUNDS):
        off = np.abs(rest) > _KNOCK * np.quantile(np.abs(rest), 0.95)
        sound = ~off if round_ == 0 else minimum_filter1d(~off, 2 * reach + 1)
        known = lagged[:, sound]
        gains = np.linalg.lstsq(known @ known.T, known @ swift[sound], rcond=1e-10)[0]
        rest = swift - gains @ lagged
    explained = float(gains @ (known @ swift[sound]))
    left = float(np.sum(swift[sound] ** 2))
    return np.asarray(gains), explained * len(swift[sound]) / max(len(gains) * left, 1e-300)


def _blurred(values: Array, width: int) -> Array:
    """The signal under a triangle of twice this many samples: what stands between two lags is not lost."""
    hat = width - np.abs(np.arange(1 - width, width))
    return np.convolve(np.pad(values, width - 1, "edge"), hat / width**2, "valid")


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
    expected[:unknown] = expected[len(expected) - unknown :] = 0.0
    for wave in waves:
        expected[wave.start : wave.stop - 3] += np.diff(wave.values, 3)
    return expected


def _cutoffs(
    values: Array,
    weights: Array,
    expected: Array,
    regions: Indices,
    rate: float,
    noise: float,
    *,
    twice: bool = False,
) -> Array:
    """The cutoff [Hz] for each region that makes the estimated error of the velocity least."""
    highest = max(min(_HIGHEST * rate, _STROKE_BAND), 2.0 * _LOWEST * rate)
    steps = int(np.log(highest / (_LOWEST * rate)) / np.log(_CUTOFF_RATIO)) + 1
    trials = np.geomspace(highest, _LOWEST * rate, steps + 1)[::-1]
    both = weights[1:] * weights[:-1]
    count = int(regions.max()) + 1
    sizes = np.bincount(regions[1:], both, count)
    costs = np.empty((len(trials), count))
    for cost, cutoff in zip(costs, trials, strict=True):
        penalty = np.full(len(expected), float(stiffness(cutoff, rate)))
        left = np.diff(values - smoothed(values, weights, penalty, expected, twice=twice)) ** 2
        cost[:] = np.bincount(regions[1:], both * left, count)
        cost += 2.0 * noise**2 * sizes * kept_noise(cutoff, rate, twice=twice)
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

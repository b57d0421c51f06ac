"""What the displacement follows of the force: an actuator gives way under the load.

The displacement is regressed on the force at some lags, if it follows it at all. Only what is swift tells: the
slow part of both is the stroke.
"""

import numpy as np
from scipy.ndimage import minimum_filter1d

from identification.arrays import Array
from identification.cutoffs import best_cutoffs
from identification.motion_parts import MOST_GIVE
from identification.recordings import Stretch
from identification.smoother import smoothed, stiffness

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
LONGEST_LAG = float(_LAGS[-1])
"""[s] behind which the displacement follows the force no more."""


def give_under_load(stretch: Stretch, weights: Array, noise: float) -> Array:
    """What the displacement follows of the force (N,) [m]; zeros where it follows nothing."""
    x, rate = stretch.displacement, stretch.rate
    nothing = np.zeros(len(x))
    # So many gains would follow the noise of fewer samples.
    if len(x) < 50 * len(_LAGS):
        return nothing
    swift, penalty = _swift(x, weights, rate, noise)
    shifts = np.unique(np.rint(_LAGS * rate).astype(int))
    reach = int(np.max(np.abs(shifts))) + 1
    force = _blurred(stretch.force, int(shifts[1] - shifts[0]))
    # The same smoother on both: what it takes from the displacement it takes from the force as well.
    driver = force - smoothed(force, np.ones(len(x)), penalty, nothing[3:])
    rows = np.arange(reach, len(x) - reach, max(1, len(x) // 100_000))
    # The rows of a stumble, and those whose lags reach into it, tell nothing.
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


def _swift(values: Array, weights: Array, rate: float, noise: float) -> tuple[Array, Array]:
    """What of a displacement (N,) [m] is noise, or follows the force; and the penalty (N-3,) that parts it."""
    nothing = np.zeros(len(values) - 3)

    def parted(block: float) -> tuple[Array, Array]:
        """By the cutoff of the middle one of all blocks of so many samples."""
        blocks = (np.arange(len(values)) / block).astype(np.intp)
        cutoffs = best_cutoffs(values, weights, nothing, blocks, rate, noise)
        penalty = np.full(len(nothing), float(stiffness(float(np.quantile(cutoffs, 0.5, method="lower")), rate)))
        # Smoothed once: what gives way stands out more clearly against that (decision 0012).
        return (values - smoothed(values, weights, penalty, nothing)) * weights, penalty

    if not weights.all():
        # Where the rod stumbled, small stumbles are left: they raise the cutoff of the whole, not of most blocks.
        swift, penalty = parted(_BLOCK * rate)
        if np.quantile(np.abs(swift[weights > 0.0]), 0.9) < _CALM * noise:
            return swift, penalty
    return parted(len(values))


def _followed(lagged: Array, swift: Array, reach: int) -> tuple[Array, float]:
    """Gains [m/N] of each lag on a displacement (rows,) [m], and how much better than chance they explain it [1].

    A knock moves rod and force by itself. It is known by what no gain explains, and what lies around it by then
    tells nothing of the actuator either.
    """
    # Before any gain is known, what stands out may be the force's own doing: at first only that is left out.
    rest, sound = swift, np.ones(len(swift), bool)
    for round_ in range(_ROUNDS):
        off = np.abs(rest) > _KNOCK * np.quantile(np.abs(rest), 0.95)
        sound = ~off if round_ == 0 else minimum_filter1d(~off, 2 * reach + 1)
        known = lagged[:, sound]
        # Neighbouring lags are nearly alike: along what the rows cannot tell apart the gains stay smallest.
        gains = np.linalg.lstsq(known @ known.T, known @ swift[sound], rcond=1e-10)[0]
        rest = swift - gains @ lagged
    explained = float(gains @ (known @ swift[sound]))
    left = float(np.sum(swift[sound] ** 2))
    # Noise alone lets every gain explain one part in len(swift).
    return np.asarray(gains), explained * len(swift[sound]) / max(len(gains) * left, 1e-300)


def _blurred(values: Array, width: int) -> Array:
    """The signal under a triangle of twice this many samples: what stands between two lags is not lost."""
    hat = width - np.abs(np.arange(1 - width, width))
    return np.convolve(np.pad(values, width - 1, "edge"), hat / width**2, "valid")

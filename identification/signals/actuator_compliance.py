"""Compliance motion: the part of the recorded displacement that follows the force.

The actuator deforms under load. The displacement is regressed on the force at several lags, if it follows the
force significantly. Only the high-frequency parts enter, because the slow part of both is the stroke.
"""

import numpy as np
from scipy.ndimage import minimum_filter1d

from identification.arrays import Array
from identification.logs import Stretch
from identification.signals.cutoff import choose_cutoffs
from identification.signals.motion_regions import MAX_COMPLIANCE_MOTION
from identification.signals.smoother import compute_penalty, smooth_signal

_LAGS = np.arange(-0.006, 0.0451, 0.003)
"""Lags [s] of the displacement behind the force."""
MAX_LAG = float(_LAGS[-1])
"""Largest lag [s] of the displacement behind the force."""
_BLOCK_LENGTH = 2.0
"""Length [s] of the blocks whose median cutoff is used for a disturbed recording."""
_NOISE_LIMIT = 3.0
"""Threshold on the 90 % quantile of the high-frequency part over the noise: above it, that part is the stroke."""
_DISTURBANCE_RATIO = 4.0
"""Threshold on a deviation over its 95 % quantile: above it, it is a disturbance and does not follow the force."""
_ITERATIONS = 3
_MIN_SIGNIFICANCE = 4.0
"""Threshold on the explained variance over that explained by chance: below it, there is no compliance motion."""


def estimate_compliance_motion(stretch: Stretch, weights: Array, stroke_cutoff: float) -> Array:
    """Return the compliance motion (N,) [m]; zeros if the displacement does not follow the force.

    Args:
        stretch: the recording.
        weights: (N,) 1 where measured and undisturbed, 0 elsewhere.
        stroke_cutoff: frequency [Hz] below which the displacement is the stroke.
    """
    x, rate = stretch.displacement, stretch.rate
    zeros = np.zeros(len(x))
    # With fewer samples the gains would follow the noise.
    if len(x) < 50 * len(_LAGS):
        return zeros
    high_frequency, penalty = _extract_high_frequency(x, weights, rate, stroke_cutoff)
    shifts = np.unique(np.rint(_LAGS * rate).astype(int))
    reach = int(np.max(np.abs(shifts))) + 1
    force = _smooth_triangular(stretch.force, int(shifts[1] - shifts[0]))
    # The same smoother on both, so that both lose the same.
    fast_force = force - smooth_signal(force, np.ones(len(x)), penalty, zeros[3:])
    rows = np.arange(reach, len(x) - reach, max(1, len(x) // 100_000))
    # Samples in a disturbance, and those whose lags reach into one, do not count.
    rows = rows[minimum_filter1d(weights, 2 * reach + 1)[rows] > 0.0]
    lagged = np.stack([fast_force[rows - shift] for shift in shifts])
    gains, significance = _fit_lag_gains(lagged, high_frequency[rows], reach)
    if significance < _MIN_SIGNIFICANCE:
        return zeros
    kernel = np.zeros(2 * reach + 1)
    kernel[reach + shifts] = gains
    motion = np.convolve(np.pad(force, reach, "edge"), kernel, "valid")
    if np.std(motion) < MAX_COMPLIANCE_MOTION * np.std(x):
        return motion
    # The regression determines the slow part of so large a motion poorly, and the smoother follows it anyway.
    return np.convolve(np.pad(fast_force, reach, "edge"), kernel, "valid")


def choose_stroke_cutoff(values: Array, weights: Array, rate: float, noise: float) -> float:
    """Return the frequency [Hz] below which a displacement is the stroke, and not compliance motion.

    Args:
        values: (N,) displacement [m].
        weights: (N,) 1 where measured and undisturbed, 0 elsewhere.
        rate: [Hz]
        noise: standard deviation of the displacement's noise [m].
    """
    expected = np.zeros(len(values) - 3)

    def choose(block_samples: float) -> float:
        """Return the median cutoff of blocks of so many samples."""
        blocks = (np.arange(len(values)) / block_samples).astype(np.intp)
        cutoffs = choose_cutoffs(values, weights, expected, blocks, rate, noise)
        return float(np.quantile(cutoffs, 0.5, method="lower"))

    if not weights.all():
        # Small disturbances remain near large ones. They raise the cutoff of the whole, but not of most blocks.
        cutoff = choose(_BLOCK_LENGTH * rate)
        high_frequency, _ = _extract_high_frequency(values, weights, rate, cutoff)
        if np.quantile(np.abs(high_frequency[weights > 0.0]), 0.9) < _NOISE_LIMIT * noise:
            return cutoff
    return choose(len(values))


def _extract_high_frequency(values: Array, weights: Array, rate: float, cutoff: float) -> tuple[Array, Array]:
    """Return the part of a displacement (N,) [m] above a cutoff [Hz], and the penalty (N-3,) that separates it."""
    penalty = np.full(len(values) - 3, float(compute_penalty(cutoff, rate)))
    # Smoothed once only: compliance motion stands out more clearly against that (decision 0012).
    return (values - smooth_signal(values, weights, penalty, np.zeros(len(penalty)))) * weights, penalty


def _fit_lag_gains(lagged: Array, displacement: Array, reach: int) -> tuple[Array, float]:
    """Return the gain [m/N] of each lag on a displacement (rows,) [m], and its significance (dimensionless).

    A disturbance moves rod and force by itself. It is recognised by the remainder of the regression, and excluded
    with all samples that its lags reach.
    """
    remainder, valid = displacement, np.ones(len(displacement), bool)
    for iteration in range(_ITERATIONS):
        deviating = np.abs(remainder) > _DISTURBANCE_RATIO * np.quantile(np.abs(remainder), 0.95)
        # Before the gains are known, a deviation may be due to the force, so its surroundings are kept at first.
        valid = ~deviating if iteration == 0 else minimum_filter1d(~deviating, 2 * reach + 1)
        columns = lagged[:, valid]
        # Neighbouring lags are nearly alike: lstsq keeps gains small in directions that the rows do not determine.
        gains = np.linalg.lstsq(columns @ columns.T, columns @ displacement[valid], rcond=1e-10)[0]
        remainder = displacement - gains @ lagged
    explained = float(gains @ (columns @ displacement[valid]))
    total = float(np.sum(displacement[valid] ** 2))
    # Noise alone lets every gain explain one part in len(displacement).
    return np.asarray(gains), explained * len(displacement[valid]) / max(len(gains) * total, 1e-300)


def _smooth_triangular(values: Array, width: int) -> Array:
    """Smooth a signal with a triangle of twice the width, so that samples between two lags count as well."""
    triangle = width - np.abs(np.arange(1 - width, width))
    return np.convolve(np.pad(values, width - 1, "edge"), triangle / width**2, "valid")

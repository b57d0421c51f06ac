"""Fisher information of strokes on the thirteen coordinates.

With white force noise the information is J'J over the noise's variance, J the slopes of the simulated force; its
inverse is the covariance below which no estimator comes (Rao 1945, Cramér 1946). The inner displacement at the
start of a stroke is unknown and taken out; the delays of the channels are known as well as a bench maps clocks.
A weak prior of ten times each coordinate's size keeps what cannot be seen finite.
"""

import numpy as np

from identification.arrays import Array, BoolArray
from identification.damper.coordinates import COORDINATES, Coordinates
from identification.simulate import UNKNOWNS, Setting, Stroke, simulate

_CLOCKS = 20e-6
"""[s] standard deviation of each channel's delay on a bench whose clocks are mapped."""
_LOOSE = 10.0
"""[1] standard deviation of the weak prior, in sizes of the coordinate."""
_Y0 = UNKNOWNS.index("y0")
_DELAYS = [UNKNOWNS.index("force_delay"), UNKNOWNS.index("drive_delay")]
_KEPT = [*range(len(COORDINATES)), *_DELAYS]


def sizes(point: Coordinates) -> Array:
    """(13,) what counts as the size of each coordinate, in its unit."""
    typical = np.array([0.1 * q.scale for q in COORDINATES])
    return np.asarray(np.maximum(np.abs(np.array(point)), typical))


def information(point: Coordinates, stroke: Stroke, noise: float) -> Array:
    """(15, 15) of a stroke on the coordinates, in their sizes, and on the two delays, in the clocks' accuracy.

    Args:
        point: the damper.
        stroke: what it is driven through; y(0) is unknown.
        noise: of the recorded force [N], white.
    """
    y0 = float(stroke.displacement[0])
    slopes = simulate(Setting(point, y0=y0), stroke, slopes=True).slopes / noise
    kept = slopes[:, _KEPT] * np.concatenate([sizes(point), [_CLOCKS, _CLOCKS]])
    start = slopes[:, _Y0]
    across = kept.T @ start
    own = float(start @ start)
    # y(0) cannot have been far outside the stroke, as in the fit.
    own += 1.0 / max(float(np.ptp(stroke.displacement)) / 2.0, 1e-4) ** 2
    # What the unknown start takes of the information (Schur).
    return np.asarray(kept.T @ kept - np.outer(across, across) / own)


def relative_covariance(found: Array) -> Array:
    """(13, 13) covariance of the coordinates, in their sizes, from the information of all strokes (15, 15)."""
    # The delays count in deviations of what is known of them, so that their prior is one.
    prior = np.concatenate([np.full(len(COORDINATES), _LOOSE**-2), [1.0, 1.0]])
    count = len(COORDINATES)
    return np.asarray(np.linalg.inv(found + np.diag(prior))[:count, :count])


def seen(found: Array) -> BoolArray:
    """(13,) True where the strokes say more of a coordinate than the weak prior does."""
    return np.asarray(np.diag(found)[: len(COORDINATES)] > _LOOSE**-2)

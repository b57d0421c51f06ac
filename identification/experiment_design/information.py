"""Fisher information of strokes on the thirteen coordinates.

With white force noise the information is J'J over the noise variance, with J the sensitivities of the simulated
force. Its inverse is the smallest covariance of any unbiased estimator (Rao 1945, Cramér 1946). The unknown inner
displacement at the start of a stroke is eliminated. The channel delays are known to the accuracy of mapped clocks.
A weak prior of ten times each coordinate's size keeps the covariance of unobservable coordinates finite.
"""

import numpy as np

from identification.arrays import Array, BoolArray
from identification.damper import COORDINATES, Coordinates
from identification.simulate import SENSITIVITY_COLUMNS, Excitation, SimulationModel, simulate

_CLOCK_DEVIATION = 20e-6
"""Standard deviation of each channel's delay on a bench with mapped clocks [s]."""
_PRIOR_DEVIATION = 10.0
"""Standard deviation of the weak prior, in sizes of the coordinate [1]."""
_Y0 = SENSITIVITY_COLUMNS.index("y0")
_DELAYS = [SENSITIVITY_COLUMNS.index("force_delay"), SENSITIVITY_COLUMNS.index("drive_delay")]
_INFORMATIVE = [*range(len(COORDINATES)), *_DELAYS]


def compute_coordinate_scales(point: Coordinates) -> Array:
    """Return the size (13,) of each coordinate in its unit: its value, but at least a tenth of its usual scale."""
    typical = np.array([0.1 * q.scale for q in COORDINATES])
    return np.asarray(np.maximum(np.abs(np.array(point)), typical))


def compute_information(point: Coordinates, stroke: Excitation, noise: float) -> Array:
    """Return the information (15, 15) of a stroke with unknown y(0) on a damper's coordinates and the two delays.

    Coordinates are counted in their sizes, delays in standard deviations of mapped clocks. ``noise`` is the
    standard deviation of the white noise in the recorded force [N].
    """
    y0 = float(stroke.displacement[0])
    sensitivities = simulate(SimulationModel(point, y0=y0), stroke, sensitivities=True).sensitivities / noise
    scaled = sensitivities[:, _INFORMATIVE] * np.concatenate(
        [compute_coordinate_scales(point), [_CLOCK_DEVIATION, _CLOCK_DEVIATION]]
    )
    start = sensitivities[:, _Y0]
    cross = scaled.T @ start
    start_information = float(start @ start)
    # Prior on y(0), as in the fit: a standard deviation of half the stroke.
    start_information += 1.0 / max(float(np.ptp(stroke.displacement)) / 2.0, 1e-4) ** 2
    # Schur complement: the information that remains with y(0) unknown.
    return np.asarray(scaled.T @ scaled - np.outer(cross, cross) / start_information)


def compute_relative_covariance(information: Array) -> Array:
    """Return the covariance (13, 13) of the coordinates in their sizes, from the information (15, 15)."""
    # The delays are counted in deviations of their prior, so that their prior is one.
    prior = np.concatenate([np.full(len(COORDINATES), _PRIOR_DEVIATION**-2), [1.0, 1.0]])
    count = len(COORDINATES)
    return np.asarray(np.linalg.inv(information + np.diag(prior))[:count, :count])


def find_observable(information: Array) -> BoolArray:
    """Return a mask (13,) of the coordinates on which the strokes contain more information than the weak prior."""
    return np.asarray(np.diag(information)[: len(COORDINATES)] > _PRIOR_DEVIATION**-2)

"""Parameter offset: distance of a network's parameters from the best simulated fit, without that fit.

From the network's parameters, one Gauss-Newton step of the simulated fit would be d = -H⁻¹ g. It is zero for a
network as good as the simulated fit. Otherwise it is the network's bias. It hardly shows in the force, whose error
grows with the square of the offset over the number of samples.
"""

import numpy as np

from identification.fitting import COORDINATE_COUNT, Problem
from identification.pinn.common import PinnResult

_MAX_OFFSET = 100.0
"""Upper bound of the offset [standard deviations]: beyond it, a single step contains little information."""


def estimate_offset(problem: Problem, result: PinnResult) -> float:
    """Return the root mean square of that step's coordinates, each in its standard deviation [1]."""
    unknowns = problem.make_start(result.coordinates)
    unknowns[problem.layout.delays] = np.array(result.delays) / problem.delay_prior
    evaluation = problem.evaluate(unknowns)
    if not np.isfinite(evaluation.cost):
        return _MAX_OFFSET
    free = problem.free_mask
    covariance = np.linalg.pinv(evaluation.hessian[np.ix_(free, free)], rcond=1e-13)
    coordinates = slice(int(free[:COORDINATE_COUNT].sum()))
    step = (covariance @ evaluation.gradient[free])[coordinates]
    return float(min(np.sqrt(np.mean(step**2 / np.diag(covariance)[coordinates])), _MAX_OFFSET))

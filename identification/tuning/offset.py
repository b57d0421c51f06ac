"""How far parameters stand from the best fit of the simulated law, without fitting it.

From the found parameters one Gauss-Newton step of the simulated fit would go d = -H⁻¹ g. A network that is as good
as the simulated fit leaves nothing to go; what is left is its own bias, which hardly shows in the force: the error
grows with the square of the offset over the number of samples.
"""

import numpy as np

from identification.pinn.result import PinnResult
from identification.problem import COMMON_COUNT, COORDINATE_COUNT, Problem

_FARTHEST = 100.0
"""[1] deviations beyond which it no longer matters how many: the step says little there."""


def offset(problem: Problem, found: PinnResult) -> float:
    """[1] root mean square of that step's coordinates, each in its standard deviation."""
    unknowns = problem.start(found.coordinates)
    unknowns[COORDINATE_COUNT:COMMON_COUNT] = np.array(found.delays) / problem.delay_prior
    there = problem.evaluate(unknowns)
    if not np.isfinite(there.cost):
        return _FARTHEST
    free = problem.free
    covariance = np.linalg.pinv(there.hessian[np.ix_(free, free)], rcond=1e-13)
    coordinates = slice(int(free[:COORDINATE_COUNT].sum()))
    step = (covariance @ there.gradient[free])[coordinates]
    return float(min(np.sqrt(np.mean(step**2 / np.diag(covariance)[coordinates])), _FARTHEST))

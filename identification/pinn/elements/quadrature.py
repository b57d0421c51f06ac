"""Quadrature in an element: Gauss points, and the derivative table of the weak form (a research option).

The law contains the velocity of the stroke. If it is weighted with a smooth function g, no derivative of the
displacement is needed. The integral of g x' over an element is g x at its ends, less the integral of g' x
(integration by parts). Let g be the polynomial through its values at M points. The integral is then a sum over
these values, and its coefficients over the quadrature weights take the place of x'. So the weak form is the
Galerkin form with another velocity: x' without the part that no polynomial through the points can follow.
"""

from functools import cache

import numpy as np
from numpy.polynomial import legendre

from identification.arrays import Array

_REFINEMENT = 4
"""Number of displacements for each Gauss point."""


@cache
def compute_gauss_points(count: int) -> tuple[Array, Array]:
    """Return the points and weights of Gauss-Legendre quadrature on 0..1."""
    points, weights = legendre.leggauss(count)
    return 0.5 + 0.5 * points, 0.5 * weights


@cache
def make_weak_derivative(count: int) -> tuple[Array, Array]:
    """Return places (F,) in 0..1 and a table (F, count) from values there to derivatives at the Gauss points.

    With these derivatives, integrals against every polynomial of a degree below ``count`` are those of integration
    by parts; the values themselves are not differentiated. Research option.
    """
    points, weights = compute_gauss_points(_REFINEMENT * count)
    places = np.concatenate([[0.0], points, [1.0]])
    degrees = 2 * np.arange(count) + 1
    # Legendre's sum for the polynomial that is 0 at all Gauss points but one, and there 1 over the weight.
    sums = legendre.legvander(2.0 * compute_gauss_points(count)[0] - 1.0, count - 1) * degrees
    ends = legendre.legvander(np.array([-1.0, 1.0]), count - 1)
    inner = 2.0 * legendre.legval(2.0 * points - 1.0, legendre.legder(np.eye(count))).T
    table = np.vstack([-ends[:1], -weights[:, None] * inner, ends[1:]])
    return places, np.asarray(table @ sums.T)

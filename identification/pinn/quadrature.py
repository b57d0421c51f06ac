"""Integrals over an element: points and weights, and the slope of what is known by its values only.

The law asks for the velocity of the stroke. Weighed with a smooth function g, it needs no derivative of the
displacement: the integral of g x' over an element is g x at its ends less the integral of g' x (by parts). Let g
be the polynomial through its values at M points; then the integral is a sum over these values, and its
coefficients, each over the weight of its point, stand where x' stood. So the weak form is the means with another
velocity: x' without what no polynomial through the points can follow.
"""

from functools import cache

import numpy as np
from numpy.polynomial import legendre

from identification.arrays import Array

_FINER = 4
"""Places for each point at which the displacement is looked up."""


@cache
def gauss_points(count: int) -> tuple[Array, Array]:
    """Points and weights of Gauss and Legendre on 0..1."""
    points, weights = legendre.leggauss(count)
    return 0.5 + 0.5 * points, 0.5 * weights


@cache
def slopes_by_parts(count: int) -> tuple[Array, Array]:
    """Places (F,) in 0..1, and a table (F, count): values there times the table are slopes at the Gauss points.

    They give the integral of every polynomial of a degree below ``count``, times the slope of what has these
    values, and take no derivative of the latter.
    """
    points, weights = gauss_points(_FINER * count)
    places = np.concatenate([[0.0], points, [1.0]])
    degrees = 2 * np.arange(count) + 1
    # Legendre's sum for a polynomial that is 0 at all Gauss points but one, and there 1 over the weight.
    sums = legendre.legvander(2.0 * gauss_points(count)[0] - 1.0, count - 1) * degrees
    ends = legendre.legvander(np.array([-1.0, 1.0]), count - 1)
    inner = 2.0 * legendre.legval(2.0 * points - 1.0, legendre.legder(np.eye(count))).T
    table = np.vstack([-ends[:1], -weights[:, None] * inner, ends[1:]])
    return places, np.asarray(table @ sums.T)

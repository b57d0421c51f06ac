"""How well the strokes fix each number.

The covariance is that of least squares, scaled by the misfit that remains. Where the misfit is no white noise,
neighbouring residuals say the same thing twice; the scores summed over blocks of time show it, and the wider of
the two variances is taken (the block sandwich, White 1980, Newey and West 1987).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array, BoolArray
from identification.condition import Own
from identification.damper.coordinates import COORDINATES, Coordinates, to_parameters
from identification.damper.parameters import GAUGE, PARAMETERS, Parameters, Quantity
from identification.problem import COORDINATE_COUNT, Problem
from identification.refine import Minimum
from identification.results import Delay, Estimate

_BLOCKS = 40
_SHORTEST_BLOCK, _LONGEST_BLOCK = 0.5, 20.0
"""[s]"""
_COLOURED = 1.5
"""[1] mean ratio of sandwich to plain variance above which the misfit counts as coloured."""
_KNOWN = 0.5
"""[1] relative standard deviation below which a number counts as identifiable."""
_OF_THE_DRIVE = ("F_b", "c0_b", "c1_b", "eta", "alpha_b")
"""What only a drive that changes can show."""
SEEN = 1e-2
"""[1] least information on an unknown of order one: below it the noise would have to be ten times less."""
_Z95, _Z99 = 1.959964, 2.575829
_CORRELATED = 0.9


@dataclass(frozen=True)
class Covariance:
    """Covariance of the unknowns, and whether the misfit was coloured."""

    unknowns: Array
    """(U, U); zero rows where an unknown was not free or stood at a bound."""
    seen: BoolArray
    """(U,) True where the force depends on the unknown at all."""
    inside: BoolArray
    """(U,) True where the unknown is free, seen and inside its bounds."""
    coloured: bool


def covariance(problem: Problem, minimum: Minimum, scatter: Array | None = None) -> Covariance:
    """Covariance of the unknowns at a minimum.

    Args:
        problem: what was minimised.
        minimum: where.
        scatter: (U, U) what the noise of the motion adds, if it was played again.
    """
    p = minimum.unknowns
    seen = np.diag(minimum.evaluation.hessian) > SEEN
    inside = problem.inside(p) & seen
    H = minimum.evaluation.hessian[np.ix_(inside, inside)]
    # A diagonal of ones: the limit below then judges directions and not the units of the unknowns.
    size = np.sqrt(np.diag(H))
    size = np.where(size > 0, size, 1.0)
    inverse = np.linalg.pinv(H / np.outer(size, size), rcond=1e-13) / np.outer(size, size)
    # A fit that happens to leave less than the noise does not narrow them.
    plain = inverse * max(1.0, minimum.evaluation.cost / problem.samples)
    scores = _block_scores(problem, p)[:, inside]
    sandwich = inverse @ (scores.T @ scores) @ inverse
    ratio = np.diag(sandwich) / np.maximum(np.diag(plain), 1e-300)
    # By the mean over many: one ratio alone, of so few blocks, varies by chance.
    coloured = bool(ratio[: min(COORDINATE_COUNT, len(ratio))].mean() > _COLOURED)
    widen = np.sqrt(np.maximum(ratio, 1.0)) if coloured else np.ones(len(ratio))
    found = np.zeros((len(p), len(p)))
    found[np.ix_(inside, inside)] = plain * np.outer(widen, widen)
    found += 0.0 if scatter is None else scatter
    return Covariance(found, problem.free & seen, inside, coloured)


def _block_scores(problem: Problem, unknowns: Array) -> Array:
    """(blocks, U) gradient of half the cost, summed over blocks of time."""
    duration = sum(len(p.force) / p.stroke.rate for p in problem.pieces)
    block = float(np.clip(duration / _BLOCKS, _SHORTEST_BLOCK, _LONGEST_BLOCK))
    rows = []
    for i, p in enumerate(problem.pieces):
        r, J = problem.residuals(unknowns, i)
        starts = np.arange(0, len(r), max(1, round(block * p.stroke.rate)))
        table = np.zeros((len(starts), len(unknowns)))
        table[:, problem.columns(i)] = np.add.reduceat(J * r[:, None], starts, axis=0)
        rows.append(table)
    return np.vstack(rows)


def unseen(found: Covariance) -> tuple[set[str], set[str]]:
    """Coordinates that these strokes cannot show, and those that stand at a bound."""
    names = np.array(Coordinates._fields)
    seen, inside = found.seen[:COORDINATE_COUNT], found.inside[:COORDINATE_COUNT]
    return set(names[~seen]), set(names[seen & ~inside])


def coordinate_covariance(problem: Problem, minimum: Minimum, found: Covariance) -> Array:
    """(13, 13) covariance of the coordinates."""
    q = minimum.unknowns[:COORDINATE_COUNT]
    D = problem.space.slopes(q)
    return D @ found.unknowns[:COORDINATE_COUNT, :COORDINATE_COUNT] @ D.T


def coordinate_estimates(
    point: Coordinates, spread: Array, hidden: set[str], at_bound: set[str], drive_unit: str
) -> dict[str, Estimate]:
    """Each coordinate with its intervals; ``spread`` is their (13, 13) covariance."""
    sd = np.sqrt(np.maximum(np.diag(spread), 0.0))
    return {
        quantity.symbol: _estimate(
            quantity, value, deviation, quantity.symbol in hidden, quantity.symbol in at_bound, drive_unit
        )
        for quantity, value, deviation in zip(COORDINATES, point, sd, strict=True)
    }


def parameter_estimates(
    point: Coordinates, spread: Array, of_coordinates: dict[str, Estimate], drive_unit: str
) -> dict[str, Estimate]:
    """The paper's fourteen at the gauge A = 301, with intervals carried over from the coordinates."""
    parameters = to_parameters(point)
    D = _slopes(lambda c: to_parameters(Coordinates(*c)), point)
    sd = np.sqrt(np.maximum(np.diag(D @ spread @ D.T), 0.0))
    estimates = {}
    for i, quantity in enumerate(PARAMETERS):
        symbol, value = quantity.symbol, parameters[i]
        if symbol == "A":
            estimates[symbol] = _gauge()
            continue
        behind = [name for name in _BEHIND.get(symbol, (symbol,)) if not of_coordinates[name].identifiable]
        unseen = any(of_coordinates[name].ci95 is None for name in behind)
        estimate = _estimate(quantity, value, float(sd[i]), unseen, False, drive_unit)
        if behind:
            notes = "; ".join(of_coordinates[name].note for name in behind)
            estimate = estimate.model_copy(update={"identifiable": False, "note": notes})
        estimates[symbol] = estimate
    return estimates


_BEHIND = {
    "alpha_a": ("F_a",),
    "alpha_b": ("F_b",),
    "beta": ("rho", "n", "D_y"),
    "gamma": ("rho", "n", "D_y"),
    "x0": ("k1",),
}
"""Coordinates that a parameter stands on; one that is named like a coordinate stands on that."""


GAUGE_WORDS = (
    "a gauge, fixed: (alpha_a, alpha_b, beta, gamma, A) -> (s alpha_a, s alpha_b, s^(n-1) beta, "
    "s^(n-1) gamma, A/s) leaves every force as it is, so no recording reveals it"
)
"""The direction that no force reveals."""


def _gauge() -> Estimate:
    return Estimate(value=GAUGE, unit="1", ci95=None, identifiable=False, note=GAUGE_WORDS)


def _slopes(function: Callable[[Array], Parameters], point: Coordinates) -> Array:
    """(14, 13) derivative by central differences; the functions are smooth and exact to rounding."""
    centre = np.array(point)
    columns = []
    for i, quantity in enumerate(COORDINATES):
        move = np.zeros(len(centre))
        move[i] = 1e-6 * max(abs(centre[i]), 1e-3 * quantity.scale)
        after, before = np.array(function(centre + move)), np.array(function(centre - move))
        columns.append((after - before) / (2 * move[i]))
    return np.column_stack(columns)


def _estimate(
    quantity: Quantity, value: float, sd: float, hidden: bool, at_bound: bool, drive_unit: str
) -> Estimate:
    """A number with its intervals and what to say of it."""
    unit = quantity.unit_for(drive_unit)
    if hidden:
        steady = quantity.symbol in _OF_THE_DRIVE
        why = "the drive never changes in these strokes" if steady else "nothing in these strokes depends on it"
        note = f"{quantity.meaning}: cannot be seen, {why}"
        return Estimate(value=value, unit=unit, ci95=None, identifiable=False, note=note)
    if not np.isfinite(sd):
        note = f"{quantity.meaning}: how far it may be off is not known, for the fit has no covariance here"
        return Estimate(value=value, unit=unit, ci95=None, identifiable=False, note=note)
    if at_bound:
        note = f"{quantity.meaning}: stands at the edge of its range, so the law cannot follow these strokes here"
        return Estimate(value=value, unit=unit, ci95=None, identifiable=False, note=note)
    relative = sd / max(abs(value), 0.1 * quantity.scale)
    known = bool(relative < _KNOWN)
    note = (
        f"known to {100 * relative:.2g} %"
        if known
        else f"{quantity.meaning}: these strokes fix it to no better than {100 * relative:.0f} %"
    )
    positive = quantity.low >= 0 and value > 0
    return Estimate(
        value=value,
        unit=unit,
        ci95=_possible(_interval(value, sd, _Z95, positive), value, quantity),
        ci99=_possible(_interval(value, sd, _Z99, positive), value, quantity),
        identifiable=known,
        note=note,
    )


def _interval(value: float, sd: float, z: float, positive: bool) -> tuple[float, float]:
    """Interval of z deviations; on the logarithm where the number cannot be negative."""
    if positive:
        # e^50 bounds nothing any more; far beyond it exp would overflow.
        factor = float(np.exp(min(z * sd / value, 50.0)))
        return value / factor, value * factor
    return value - z * sd, value + z * sd


def _possible(interval: tuple[float, float], value: float, quantity: Quantity) -> tuple[float, float]:
    """The part of an interval in which the quantity can lie; it always holds the value."""
    low, high = interval
    return min(max(low, quantity.low), value), max(min(high, quantity.high), value)


def delay_estimate(value: float, sd: float, prior: float, *, seen: bool) -> Delay:
    """A channel's residual delay [s] beside its prior [s]; without an interval where only the prior speaks."""
    return Delay(
        value=value,
        ci95=_interval(value, sd, _Z95, False) if seen else None,
        prior_sd=prior,
        outside_prior=abs(value) > 3.0 * prior,
        note="" if seen else "cannot be seen: these strokes show no change that it would delay",
    )


def own_estimate(own: Own, unknown: float, sd: float) -> Estimate:
    """What a log has of its own, from an unknown of the search and its standard deviation."""
    value, deviation = own.value(unknown, sd)
    return Estimate(
        value=value,
        unit=own.unit,
        ci95=_interval(value, deviation, _Z95, False),
        ci99=_interval(value, deviation, _Z99, False),
        identifiable=sd < _KNOWN,
        note=own.meaning,
    )


def strong_correlations(spread: Array) -> dict[str, float]:
    """Pairs of coordinates that these strokes hardly tell apart, from their (13, 13) covariance."""
    sd = np.sqrt(np.maximum(np.diag(spread), 0.0))
    names = Coordinates._fields
    found = {}
    for i in range(len(names)):
        for j in range(i):
            if sd[i] > 0 and sd[j] > 0 and abs(r := spread[i, j] / (sd[i] * sd[j])) > _CORRELATED:
                found[f"{names[j]},{names[i]}"] = round(float(r), 4)
    return found

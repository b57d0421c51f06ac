"""How far the force channel's clock wanders within a run, and what that does to a fit.

What is left between the clocks of two devices changes over seconds. A force that is late by some ten microseconds
looks like one that is a little stiffer, and k0 and k1 of a clean fit lie several of their deviations off. So the
delay is let bend at the end of a fit, along straight lines between knots. How far is told by the recording itself,
where the likelihood of its residuals is greatest with the bends integrated out (empirical Bayes; Robbins 1956).
The unknowns follow by one Gauss-Newton step from which the knots are eliminated; their intervals grow with them.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from identification.arrays import Array, BoolArray
from identification.problem import COORDINATE_COUNT, Problem
from identification.refine import Minimum

_KNOTS = 4.0
"""[s] from knot to knot."""
_LEAST = 1e-6
"""[s] smallest wander that is tried."""
_CHANCE = 6.0
"""[1] by which twice the logarithm of the likelihood must grow for a wander to be more than chance."""
_TRIALS = 60
_SEEN = 1e-9
"""[1] information on a bend, of the largest, below which it says nothing."""
_TOLD = 10e-6
"""[s] from which on a person should know of it."""


class _Bends(NamedTuple):
    """What the bends of the delay do, in units of the noise; B of them."""

    own: Array
    """(B, B) information of the bends on each other [1/s²]."""
    shared: Array
    """(U, B) with the unknowns [1/s]."""
    gradient: Array
    """(B,) of half the cost [1/s]."""


def without_wander(problem: Problem, minimum: Minimum) -> tuple[Minimum, float]:
    """A minimum as it is where the force's delay may bend, and the standard deviation [s] of that.

    The information in its ``evaluation`` is what the bends leave of it.

    Args:
        problem: what was minimised.
        minimum: where.
    """
    bends = _bends(problem, minimum.unknowns, _both(problem, minimum.unknowns))
    H, gradient = minimum.evaluation.hessian, minimum.evaluation.gradient
    inside = problem.inside(minimum.unknowns)
    free = np.ix_(inside, inside)
    wander = _likeliest(bends, H[free], gradient[inside], inside, problem.delay_prior)
    if not wander:
        return minimum, 0.0
    left, step = _step(bends, H, gradient, inside, wander)
    unknowns = np.clip(minimum.unknowns + step, *problem.bounds())
    return replace(minimum, unknowns=unknowns, evaluation=replace(minimum.evaluation, hessian=left)), wander


def bent_away(problem: Problem, unknowns: Array, spread: float) -> tuple[list[Array], float]:
    """What is added to the residuals where the delay bends and the unknowns follow; and how far it bends.

    Args:
        problem: with all samples marked that are to be looked at.
        unknowns: (U,) of a fit.
        spread: to which the clocks are known [s], one deviation: it holds the bends.

    Returns:
        (N,) of each piece, in units of the noise; and the root mean square of the bends [s].
    """
    both, here = _both(problem, unknowns), problem.evaluate(unknowns)
    bends = _bends(problem, unknowns, both)
    _, step = _step(bends, here.hessian, here.gradient, problem.inside(unknowns), spread)
    bent = -np.linalg.solve(_held(bends, spread), bends.gradient + bends.shared.T @ step)
    added, start = [], 0
    for i, (piece, (r, J)) in enumerate(zip(problem.pieces, both, strict=True)):
        hats = _hats(len(r), piece.stroke.rate)
        own = bent[start : start + hats.shape[1]]
        added.append(J @ step[problem.columns(i)] + (hats @ own) * J[:, COORDINATE_COUNT] / problem.delay_prior)
        start += len(own)
    return added, float(np.sqrt(np.mean(bent**2)))


def _step(bends: _Bends, H: Array, gradient: Array, inside: BoolArray, wander: float) -> tuple[Array, Array]:
    """The information (U, U) that the bends leave of the unknowns, and the step (U,) of these beside them."""
    # The bends are eliminated (Schur), each held by the wander.
    shared = np.linalg.solve(_held(bends, wander), bends.shared.T)
    left, pull = H - bends.shared @ shared, gradient - shared.T @ bends.gradient
    step = np.zeros(len(H))
    step[inside] = -np.linalg.solve(left[np.ix_(inside, inside)], pull[inside])
    return left, step


def _held(bends: _Bends, wander: float) -> Array:
    return np.asarray(bends.own + np.eye(len(bends.own)) / wander**2)


def wander_in_words(wander: float) -> tuple[str, ...]:
    """What a person should know of a wander [s]; nothing of a small one."""
    if wander < _TOLD:
        return ()
    return (
        f"the delay of the force wanders by {1e6 * wander:.2g} µs within the run, as clocks do; what is surer "
        "without that (k0 and k1 most) has wider intervals for it",
    )


def _both(problem: Problem, unknowns: Array) -> list[tuple[Array, Array]]:
    """Residuals (N,) and slopes (N, C) of each piece, in units of the noise."""
    return [problem.residuals(unknowns, i) for i in range(len(problem.pieces))]


def _bends(problem: Problem, unknowns: Array, both: Sequence[tuple[Array, Array]]) -> _Bends:
    own, shared, gradients = [], [], []
    for i, (piece, (r, J)) in enumerate(zip(problem.pieces, both, strict=True)):
        # The fit counts its delay in deviations of the prior; a bend is in seconds.
        bent = _hats(len(r), piece.stroke.rate) * (J[:, COORDINATE_COUNT] / problem.delay_prior)[:, None]
        rows = np.zeros((len(unknowns), bent.shape[1]))
        rows[problem.columns(i)] = J.T @ bent
        own.append(bent.T @ bent)
        shared.append(rows)
        gradients.append(bent.T @ r)
    return _Bends(block_diag(*own), np.hstack(shared), np.concatenate(gradients))


def _hats(count: int, rate: float) -> Array:
    """(count, knots) weights of the knots in each sample."""
    time = np.arange(count) / rate
    knots = np.linspace(0.0, time[-1], max(round(time[-1] / _KNOTS), 1) + 1)
    return np.stack([np.interp(time, knots, one) for one in np.eye(len(knots))], axis=1)


def _likeliest(bends: _Bends, H: Array, gradient: Array, inside: BoolArray, most: float) -> float:
    """The wander [s] with which the residuals are likeliest, the unknowns fitted along; 0 if it may be chance."""
    shared = bends.shared[inside]
    solved = np.linalg.solve(H, np.column_stack([shared, gradient]))
    information = bends.own - shared.T @ solved[:, :-1]
    # In these directions the bends are independent: one decomposition serves every trial.
    size, turned = np.linalg.eigh(information)
    seen = size > _SEEN * size[-1]
    size, slope = size[seen], (turned.T @ (bends.gradient - shared.T @ solved[:, -1]))[seen]
    trials = np.concatenate([[0.0], np.geomspace(_LEAST, max(most, 2.0 * _LEAST), _TRIALS)])
    grown = 1.0 + trials[:, None] ** 2 * size
    # Twice the negative logarithm of the likelihood, up to what no wander changes.
    unlikely = np.sum(np.log(grown) + slope**2 / (size * grown), axis=1)
    best = int(np.argmin(unlikely))
    return float(trials[best]) if unlikely[0] - unlikely[best] > _CHANCE else 0.0

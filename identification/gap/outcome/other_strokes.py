"""Growth of the remaining error on other strokes than the recorded ones.

The error that effects leave is known on the recorded strokes only. There, the fit of law and effects has absorbed
a part of it. On strokes of other amplitude and frequency that part returns, and the gap has another size. Both are
computed for the recorded strokes with changed amplitude and speed. The remaining error is a random smooth function
of motion, drive and time, because its true form is not known (Kennedy and O'Hagan 2001).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from identification.arrays import Array
from identification.fitting import Piece, Problem
from identification.gap.data import Indices
from identification.gap.fits import Candidate

_CHANGE = 0.25
"""Usual change of amplitude and of speed from one method to another, as a logarithm [1]."""
_CYCLE_SAMPLES = 100
"""Smallest number of simulated samples of a usual cycle; fewer would not show the loop."""
_SAMPLES = 5000
"""Largest number of samples that are compared."""
_DRAWS = 60
"""Number of random functions."""
_WAVES = 60
"""Number of waves of which a random function consists (Rahimi and Recht 2007)."""
_SCALES = (1.0, 3.0)
"""Shortest and longest scale over which a random function changes, in units of the recorded ranges."""
_PRIOR_WEIGHT = 1.0
"""Weight of the prior of an unknown: a change of order one, in search coordinates."""


@dataclass(frozen=True)
class _Strokes:
    """Strokes of one amplitude and speed, simulated with law and effects."""

    variables: Array
    """(N, 5) displacement, velocity, acceleration, drive and time, in units of the recorded ranges."""
    sensitivities: Array
    """(N, U) derivatives of the force over the unknowns, in units of the noise."""
    gap: float
    """Mean square of the change of the force by the effects and the refit [N²]."""

    @staticmethod
    def make(problem: Problem, unknowns: Array, law_force: Array, chosen: Indices, ranges: Array) -> "_Strokes":
        """Simulate the pieces of a problem; ``chosen`` (N,) are the samples that count."""
        force, sensitivities = _simulate(problem, unknowns)
        variables = np.vstack([_stack_variables(p) for p in problem.pieces])
        gap = float(np.var((force - law_force)[chosen]))
        return _Strokes((variables / ranges)[chosen], sensitivities[chosen], gap)


def estimate_error_growth(named: Candidate, baseline: Candidate) -> Array:
    """Estimate by how much the remaining part of the gap is larger on other strokes, (draws,) [1].

    Args:
        named: a set of effects.
        baseline: the law without effects, fitted to the same recordings.
    """
    scales = named.fit.problem.space.scales
    factor = max(1, int(scales.sampling_rate * scales.cycle_duration / _CYCLE_SAMPLES))
    problem = named.fit.problem.decimate(factor)
    # The baseline may have been fitted at another rate, so its unknowns are simulated with these pieces.
    law = problem.replace_effects(())
    chosen = _choose_samples(problem.pieces)
    variables = np.vstack([_stack_variables(p) for p in problem.pieces])[chosen]
    ranges = np.maximum(np.abs(variables).max(axis=0), np.finfo(float).tiny)

    def simulate(amplitude: float, speed: float) -> _Strokes:
        changed = [replace(p, pieces=_change_strokes(p.pieces, amplitude, speed)) for p in (problem, law)]
        law_force = np.concatenate(changed[1].simulate(baseline.fit.minimum.unknowns))
        return _Strokes.make(changed[0], named.fit.minimum.unknowns, law_force, chosen, ranges)

    changes = np.exp([-_CHANGE, _CHANGE])
    others = [simulate(a, s) for a, s in product(changes, repeat=2)]
    return _draw_growths(simulate(1.0, 1.0), others, problem)


def _choose_samples(pieces: Sequence[Piece]) -> Indices:
    """Draw fitted samples of all pieces, in their order, (N,)."""
    fitted = np.flatnonzero(np.concatenate([p.train for p in pieces]))
    if len(fitted) <= _SAMPLES:
        return fitted
    return np.sort(np.random.default_rng(0).choice(fitted, _SAMPLES, replace=False))


def _draw_growths(recorded: _Strokes, others: list[_Strokes], problem: Problem) -> Array:
    """Draw the growth for random functions and the other strokes, (draws,) [1].

    The fit absorbs what it can of the error on the recorded strokes. Its unknowns then have a wrong value. Other
    strokes on which the model is unstable are left out.
    """
    random = np.random.default_rng(0)
    free = problem.free_mask
    shared = free.copy()
    # Other strokes begin with their own y(0).
    shared[problem.layout.y0] = False
    J = recorded.sensitivities[:, free]
    # The drawn samples stand for all fitted ones.
    weight = problem.samples / len(J)
    normal = J.T @ J * weight + _PRIOR_WEIGHT * np.eye(J.shape[1])
    growths = []
    for _ in range(_DRAWS):
        error_function = _draw_function(random)
        error, step = error_function(recorded.variables), np.zeros(len(free))
        step[free] = -np.linalg.solve(normal, J.T @ error * weight)
        remaining = float(np.mean((error + recorded.sensitivities @ step) ** 2)) / recorded.gap
        for other in others:
            with np.errstate(all="ignore"):  # of an unstable model
                returned = error_function(other.variables) + other.sensitivities[:, shared] @ step[shared]
                growths.append(np.var(returned) / np.float64(other.gap) / remaining)
    known = np.array([growth for growth in growths if np.isfinite(growth)])
    return known if known.size else np.ones(1)


def _draw_function(random: np.random.Generator) -> Callable[[Array], Array]:
    """Draw a smooth random function of variables (N, V) with a mean square of one, in units of the noise."""
    scale = random.uniform(*_SCALES)
    phases = random.uniform(0.0, 2.0 * np.pi, _WAVES)
    waves = random.standard_normal((5, _WAVES)) / scale
    return lambda variables: np.asarray(np.sqrt(2.0 / _WAVES) * np.cos(variables @ waves + phases).sum(axis=1))


def _simulate(problem: Problem, unknowns: Array) -> tuple[Array, Array]:
    """Return the force (N,) [N] of all pieces and its derivatives (N, U), in units of the noise."""
    forces, rows = [], []
    for i, piece in enumerate(problem.pieces):
        residual, J = problem.compute_residuals(unknowns, i)
        table = np.zeros((len(residual), len(unknowns)))
        table[:, problem.find_columns(i)] = J
        forces.append(residual * problem.noise + piece.force)
        rows.append(table)
    return np.concatenate(forces), np.vstack(rows)


def _change_strokes(pieces: tuple[Piece, ...], amplitude: float, speed: float) -> tuple[Piece, ...]:
    """Return pieces with a factor on the amplitude of the motion and on its speed; all samples count."""
    centre = float(np.mean([p.excitation.displacement.mean() for p in pieces]))
    return tuple(_change_stroke(p, amplitude, speed, centre) for p in pieces)


def _change_stroke(piece: Piece, amplitude: float, speed: float, centre: float) -> Piece:
    e = piece.excitation
    changed = replace(
        e,
        rate=e.rate * speed,
        start=e.start / speed,
        displacement=centre + amplitude * (e.displacement - centre),
        velocity=amplitude * speed * e.velocity,
        acceleration=amplitude * speed**2 * e.acceleration,
        power=None if e.power is None else amplitude * speed * e.power,
    )
    return replace(piece, excitation=changed, train=np.ones(len(piece.force)))


def _stack_variables(piece: Piece) -> Array:
    """Return displacement, velocity, acceleration, drive and time of a piece as columns (N, 5)."""
    e = piece.excitation
    return np.column_stack([e.displacement, e.velocity, e.acceleration, e.sampled_drive, e.time])

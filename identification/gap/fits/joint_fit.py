"""Joint fit of the law and chosen effects.

The fit starts at several points and descends on decimated data; the best result is refined on all samples.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from identification.arrays import Array
from identification.damper import Coordinates
from identification.fitting import COORDINATE_COUNT, EffectModel, Minimum, Problem, minimise
from identification.gap.fits.fit_options import DEFAULT_OPTIONS, FitOptions
from identification.gap.fits.starts import KnownValues, generate_starts
from identification.progress import ignore_progress
from identification.simulate import ActiveEffect, SimulationModel
from identification.threads import use_one_thread
from identification.uncertainty import Covariance, estimate_covariance

_BACKLASH_DECIMATION = 2
"""Largest decimation with backlash, whose contacts are short."""
_REFIT_TOLERANCE = 1e-5
"""Part of the excess that a step on all samples must be expected to remove, else the refit ends [1]."""
_SAME_COST = 1.005
"""Ratio of costs within which two descents count as the same minimum."""


@dataclass(frozen=True)
class JointFit:
    """Result of a joint fit."""

    problem: Problem
    """The minimised problem, effects included."""
    minimum: Minimum

    @property
    def effects(self) -> tuple[EffectModel, ...]:
        """Fitted effects."""
        return self.problem.effects

    @property
    def active_effects(self) -> tuple[ActiveEffect, ...]:
        """Fitted effects with their values."""
        return self.problem.make_active_effects(self.minimum.unknowns)

    @property
    def coordinates(self) -> Coordinates:
        """Regular coordinates of the law."""
        return self.problem.space.to_coordinates(self.minimum.unknowns[:COORDINATE_COUNT])

    @property
    def values(self) -> dict[str, dict[str, float]]:
        """Parameters of the effects [SI], by effect and symbol."""
        return {
            e.effect.name: {q.symbol: v for q, v in zip(e.form.parameters, e.values, strict=True)}
            for e in self.active_effects
        }

    @cached_property
    def deviations(self) -> dict[str, dict[str, float]]:
        """Standard deviations of these parameters [SI]; infinite where the strokes do not determine them."""
        sd = np.sqrt(np.diag(self.covariance.unknowns))
        interior, deviations = self.covariance.interior, {}
        for model, columns in self.problem.iterate_effects():
            scaled = sd[columns] * model.differentiate(self.minimum.unknowns[columns])
            known = np.where(interior[columns], scaled, np.inf)
            deviations[model.name] = {q.symbol: float(s) for q, s in zip(model.quantities, known, strict=True)}
        return deviations

    @cached_property
    def covariance(self) -> Covariance:
        """Covariance of all unknowns."""
        return estimate_covariance(self.problem, self.minimum)

    @property
    def rmse(self) -> float:
        """Force error over the fitted samples [N]."""
        return self.problem.noise * float(np.sqrt(self.minimum.evaluation.cost / self.problem.samples))

    @property
    def ratio(self) -> float:
        """Force error relative to the noise floor [1]."""
        return self.rmse / self.problem.noise

    @property
    def converged(self) -> bool:
        """True if the descent converged."""
        return self.minimum.converged

    def make_model(self, piece: int) -> SimulationModel:
        """Return the simulation model of one piece."""
        return self.problem.make_model(self.minimum.unknowns, piece)

    @cached_property
    def force_errors(self) -> tuple[Array, ...]:
        """Simulated less recorded force [N], (N,) for each piece, held-out samples included."""
        forces = self.problem.simulate(self.minimum.unknowns)
        return tuple(f - p.force for f, p in zip(forces, self.problem.pieces, strict=True))


def fit_jointly(
    problem: Problem,
    effects: tuple[EffectModel, ...],
    start: JointFit | Array | None = None,
    options: FitOptions = DEFAULT_OPTIONS,
    further: Sequence[Array] = (),
) -> JointFit:
    """Fit the law together with effects.

    Args:
        problem: pieces, noise and priors; its own effects are replaced.
        effects: effects that are fitted with the law.
        start: an earlier fit, whose values are kept for common effects, or unknowns of the problem without
            effects; None starts from the regression.
        options: decimation, starts and iterations.
        further: unknowns (U,) of the joint problem that are starts as well, such as the end of a screening.
    """
    joint = problem.replace_effects(effects)
    backlash = any(e.form.action == "displacement_backlash" for e in effects)
    decimation = min(options.decimation, _BACKLASH_DECIMATION) if backlash else options.decimation
    # Without a full refit the given problem is a fast variant already.
    quick = joint.make_fast().decimate(decimation) if options.refit_full else joint
    unknowns = start.minimum.unknowns if isinstance(start, JointFit) else start
    known = _get_known_values(start) if isinstance(start, JointFit) else {}
    with use_one_thread():
        starts = generate_starts(quick.decimate(options.start_decimation), unknowns, known, options, further)
        best = _descend(quick, [s.unknowns for s in sorted(starts, key=lambda s: s.cost)], options)
        if not options.refit_full:
            return JointFit(quick, best)
        best = minimise(joint.make_fast(), best.unknowns, options.iterations, ignore_progress)
        if backlash or any(p.low_pass for p in joint.pieces):
            best = minimise(joint, best.unknowns, options.iterations, ignore_progress)
    return JointFit(joint, best)


def _get_known_values(fit: JointFit) -> KnownValues:
    return {model: active.values for model, active in zip(fit.effects, fit.active_effects, strict=True)}


def _descend(problem: Problem, starts: Sequence[Array], options: FitOptions) -> Minimum:
    """Return the best minimum from some starts, the most promising first; stop at one that is no better."""
    minima: list[Minimum] = []
    for unknowns in starts[: options.descents]:
        minima.append(
            minimise(problem, unknowns, options.iterations, ignore_progress, tolerance=options.tolerance)
        )
        if len(minima) > 1 and minima[-1].evaluation.cost * _SAME_COST > minima[0].evaluation.cost:
            break
    return min(minima, key=lambda m: m.evaluation.cost)


def refit_all_samples(problem: Problem, near: JointFit, simulated: Sequence[Array], iterations: int) -> JointFit:
    """Refine a fit of decimated data on all samples.

    Filter and backlash between the samples cost several times as much as all else, and their contribution hardly
    changes near the minimum. It is taken from one exact simulation and kept while the fast variant descends.

    Args:
        problem: problem of all samples; its effects are replaced.
        near: result of the search.
        simulated: forces [N] of the exact simulation of that result, (N,) for each piece.
        iterations: largest number of iterations.
    """
    quick, unknowns = problem.replace_effects(near.effects).make_fast(), near.minimum.unknowns
    corrections = [exact - fast for exact, fast in zip(simulated, quick.simulate(unknowns), strict=True)]
    pieces = tuple(replace(p, force=p.force - c) for p, c in zip(quick.pieces, corrections, strict=True))
    corrected = replace(quick, pieces=pieces)
    with use_one_thread():
        minimum = minimise(corrected, unknowns, iterations, ignore_progress, tolerance=_REFIT_TOLERANCE)
        return JointFit(corrected, minimum)

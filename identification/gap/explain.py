"""The law and chosen effects, fitted together.

Warm starts lose large effects: under a wrong law the coordinates have moved to where they hide the effect, and
from there it looks small. So a fit with effects starts where coordinates and effects move together (one
Gauss-Newton step with a line search), and once more from the coordinates that the regression gives. The way is
gone on a thinned problem; the best end is refined on all samples.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product

import numpy as np

from identification.arrays import Array
from identification.damper.coordinates import Coordinates
from identification.effect_choice import EffectChoice
from identification.gap.unknowns import with_effects_at
from identification.problem import COORDINATE_COUNT, Evaluation, Problem
from identification.refine import Minimum, bounded_step, descend
from identification.simulate import ActiveEffect, Setting
from identification.start import starting_points
from identification.threads import one_thread
from identification.uncertainty import Covariance, covariance

_CUTS = (1.0, 0.5, 0.2, 0.05)
"""[1] parts of a joint step that are tried."""
_DAMPING = 1e-4
"""[1] of the joint step, over the information on each unknown."""
_SETTLING = 1e-3
"""[1] damping of a step of the law alone."""
_AS_PROMISED = 0.7
"""[1] part of the promised fall after which no shorter step is tried."""
_PLAY_THIN = 2
"""Every so many samples at most where there is play: its contacts are short."""
_SAME = 1.005
"""[1] ratio of costs within which two ends count as one."""


@dataclass(frozen=True)
class Effort:
    """How hard a joint fit tries."""

    thin: int = 4
    """Every so many samples on the way; 1 takes all from the beginning."""
    starts: int = 6
    """Most starts that are judged."""
    descents: int = 2
    """Most of them that are followed down."""
    iterations: int = 40
    """Most steps of one descent."""
    default_start: bool = True
    """Whether the regression's coordinates are a start too."""
    look: int = 1
    """Every so many of the thinned samples on which starts are judged."""
    settling: int = 0
    """Steps of the law alone beside an effect that stays as it starts, before both move together."""
    polish: bool = True
    """Whether the end is refined on all samples; without, figures are those of the thinned problem."""


@dataclass(frozen=True)
class JointFit:
    """Law and effects, fitted together."""

    problem: Problem
    """What was minimised, effects included."""
    minimum: Minimum
    """Where."""

    @property
    def effects(self) -> tuple[EffectChoice, ...]:
        """What stands beside the law."""
        return self.problem.effects

    @property
    def active(self) -> tuple[ActiveEffect, ...]:
        """The effects with their values."""
        return self.problem.active_effects(self.minimum.unknowns)

    @property
    def coordinates(self) -> Coordinates:
        """The law's."""
        return self.problem.space.to_coordinates(self.minimum.unknowns[:COORDINATE_COUNT])

    @property
    def values(self) -> dict[str, dict[str, float]]:
        """Parameters of the effects, by the effects' names [SI]."""
        return {
            e.effect.name: {q.symbol: v for q, v in zip(e.form.parameters, e.values, strict=True)}
            for e in self.active
        }

    @cached_property
    def deviations(self) -> dict[str, dict[str, float]]:
        """Standard deviations of these parameters [SI]; infinite where the strokes say nothing."""
        sd = np.sqrt(np.diag(self.covariance.unknowns))
        seen, found = self.covariance.inside, {}
        for choice, own in self.problem.effect_places():
            scaled = sd[own] * choice.slopes(self.minimum.unknowns[own])
            known = np.where(seen[own], scaled, np.inf)
            found[choice.name] = {q.symbol: float(s) for q, s in zip(choice.quantities, known, strict=True)}
        return found

    @cached_property
    def covariance(self) -> Covariance:
        """Of all unknowns, in search numbers."""
        return covariance(self.problem, self.minimum)

    @property
    def rmse(self) -> float:
        """Force error over the fitted samples [N]."""
        return self.problem.noise * float(np.sqrt(self.minimum.evaluation.cost / self.problem.samples))

    @property
    def ratio(self) -> float:
        """That error over the noise floor [1]."""
        return self.rmse / self.problem.noise

    @property
    def converged(self) -> bool:
        """Whether the descent came to an end."""
        return self.minimum.converged

    def setting(self, piece: int) -> Setting:
        """What a piece is simulated with."""
        return self.problem.setting(self.minimum.unknowns, piece)

    @cached_property
    def errors(self) -> tuple[Array, ...]:
        """Simulated less recorded force [N] of every piece, (N,) each, held-out samples included."""
        forces = self.problem.simulate(self.minimum.unknowns)
        return tuple(f - p.force for f, p in zip(forces, self.problem.pieces, strict=True))

    def rmse_on(self, masks: Sequence[Array]) -> float:
        """Force error [N] over the samples that masks (N,) choose, one a piece."""
        chosen = [e[np.asarray(m) > 0] for e, m in zip(self.errors, masks, strict=True)]
        return float(np.sqrt(np.mean(np.concatenate(chosen) ** 2)))

    @property
    def words(self) -> str:
        """The fit in a line."""
        with_ = " and ".join(f"{c.name} ({c.form_name})" for c in self.effects) or "no effect"
        end = "" if self.converged else "; not converged"
        return f"with {with_} the law leaves {self.rmse:.3g} N, {self.ratio:.3f} times the noise floor{end}"


@dataclass(frozen=True)
class Start:
    """Where a descent may begin."""

    unknowns: Array
    """(U,) of the problem with its effects."""
    cost: float = field(default=float("inf"))
    """[1] there."""


def fit_with(
    problem: Problem,
    effects: tuple[EffectChoice, ...],
    start: "JointFit | Array | None" = None,
    effort: Effort = Effort(),
    further: Sequence[Array] = (),
) -> JointFit:
    """Fit the law together with effects.

    Args:
        problem: pieces, noise, priors; its own effects are replaced.
        effects: what stands beside the law.
        start: an earlier fit (its effects that are here too keep their values), or unknowns of the plain problem;
            the regression's if None.
        effort: how hard to try.
        further: unknowns (U,) of the joint problem that are starts as well, such as a screening's.
    """
    joint = problem.with_effects(effects)
    play = any(e.form.acts == "displacement_follower" for e in effects)
    # Without a polish the problem is taken as it comes: it has been made quick already.
    quick = (
        joint.quicker().coarser(min(effort.thin, _PLAY_THIN) if play else effort.thin) if effort.polish else joint
    )
    with one_thread():
        starts = sorted(_starts(quick.coarser(effort.look), start, effort, further), key=lambda s: s.cost)
        ends: list[Minimum] = []
        for begin in starts[: effort.descents]:
            ends.append(descend(quick, begin.unknowns, effort.iterations, _silent))
            if len(ends) > 1 and ends[-1].evaluation.cost * _SAME > ends[0].evaluation.cost:
                break
        best = min(ends, key=lambda m: m.evaluation.cost)
        if not effort.polish:
            return JointFit(quick, best)
        best = descend(joint.quicker(), best.unknowns, effort.iterations, _silent)
        if play or any(p.low_pass for p in joint.pieces):
            best = descend(joint, best.unknowns, effort.iterations, _silent)
    return JointFit(joint, best)


def fit_on_all(problem: Problem, near: JointFit, simulated: Sequence[Array], iterations: int) -> JointFit:
    """The end of a way on thinned samples, taken on all of them.

    What filter and play between samples do to the force costs several times all else and hardly changes near the
    end: it is taken from a whole simulation, and held while the quick problem descends.

    Args:
        problem: all samples; its effects are replaced.
        near: where the search ended.
        simulated: (N,) forces [N] of the whole simulation there, one a piece.
        iterations: most steps.
    """
    quick, unknowns = problem.with_effects(near.effects).quicker(), near.minimum.unknowns
    missed = [whole - own for whole, own in zip(simulated, quick.simulate(unknowns), strict=True)]
    pieces = tuple(replace(p, force=p.force - m) for p, m in zip(quick.pieces, missed, strict=True))
    held = replace(quick, pieces=pieces)
    with one_thread():
        return JointFit(held, descend(held, unknowns, iterations, _silent))


def _silent(what: str, error: float) -> None:
    return None


def _starts(
    problem: Problem, start: "JointFit | Array | None", effort: Effort, further: Sequence[Array]
) -> Iterator[Start]:
    """Every start that is worth a look, each after its joint step."""
    for unknowns in further:
        yield joint_step(problem, _settled(problem, unknowns, effort.settling))[0]
    base = [] if start is None else [start.minimum.unknowns if isinstance(start, JointFit) else start]
    if effort.starts and (start is None or effort.default_start):
        plain = problem.with_effects(())
        base.append(starting_points(plain)[0])
    known = start if isinstance(start, JointFit) else None
    count = 0
    for unknowns in base:
        for values in _combinations(problem.effects, known):
            if count >= effort.starts:
                return
            count += 1
            yield joint_step(problem, with_effects_at(problem, unknowns, values))[0]


def _settled(problem: Problem, unknowns: Array, steps: int) -> Array:
    """Unknowns (U,) after some steps of the law alone.

    A play or a soft fixture is soon lost where the law still has a wrong yield displacement.
    """
    free = problem.free & ~problem.delays
    free[problem.first_effect : problem.first_own] = False
    for _ in range(steps):
        here = problem.evaluate(unknowns)
        if not np.isfinite(here.cost):
            break
        scale = np.diag(here.hessian)
        step = bounded_step(problem, here, free, _SETTLING * np.maximum(scale, 1e-9 * scale.max()), unknowns)
        cut = next((c for c in _CUTS if problem.cost(unknowns + c * step) < here.cost), None)
        if cut is None:
            break
        unknowns = unknowns + cut * step
    return unknowns


def _combinations(effects: tuple[EffectChoice, ...], known: JointFit | None) -> Iterator[Array]:
    """Search numbers of the effects to begin with: as known, or each of their forms' starts."""
    kept = {} if known is None else {c: a.values for c, a in zip(known.effects, known.active, strict=True)}
    per_effect = [[kept[e]] if e in kept else list(e.form.starts) for e in effects]
    for chosen in product(*per_effect):
        yield np.concatenate([e.to_search(v) for e, v in zip(effects, chosen, strict=True)] or [np.empty(0)])


def joint_step(problem: Problem, unknowns: Array) -> tuple[Start, Evaluation, float]:
    """One Gauss-Newton step in all unknowns together, cut until the cost falls.

    Returns:
        The best point tried, the evaluation where the step began, and the cost that the step promised.
    """
    here = problem.evaluate(unknowns)
    if not np.isfinite(here.cost):
        return Start(unknowns), here, np.inf
    step, promised = promised_step(problem, here, unknowns)
    best = Start(unknowns, here.cost)
    for cut in _CUTS:
        there = Start(unknowns + cut * step, problem.cost(unknowns + cut * step))
        if there.cost < best.cost:
            best = there
            if here.cost - there.cost > _AS_PROMISED * (here.cost - promised):
                break
        elif best.cost < here.cost:
            break
    return best, here, promised


def promised_step(problem: Problem, here: Evaluation, unknowns: Array) -> tuple[Array, float]:
    """The Gauss-Newton step (U,) inside the bounds, and the cost that it promises; delays stay where they are."""
    free = problem.free & ~problem.delays
    scale = np.diag(here.hessian)
    damping = _DAMPING * np.maximum(scale, 1e-9 * scale.max())
    step = bounded_step(problem, here, free, damping, unknowns)
    return step, here.cost + 2.0 * float(here.gradient @ step) + float(step @ here.hessian @ step)

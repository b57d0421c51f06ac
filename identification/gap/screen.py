"""A first look at every effect: by how much it would lower the cost, were the force linear in all unknowns.

Each form is put beside the baseline at its starts (none of it, but with several lengths, speeds or times; or a
little of it, where none would show nothing). One Gauss-Newton step moves the law's coordinates and the effect
together, inside their bounds, so that what the coordinates could have done alone does not count. The slopes over
the law are those of the baseline, and those over an effect are differences of two simulations: the exact ones, and
the step itself with a line search, are kept for the effects that promise most.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.damper.effects import EFFECTS, USUAL
from identification.effect_choice import EffectChoice
from identification.gap.explain import JointFit, joint_step, promised_step
from identification.gap.hum import MAINS
from identification.gap.unknowns import with_further
from identification.problem import Evaluation, Problem
from identification.threads import one_thread

THIN = 4
"""Every so many samples that a screening looks at."""
ALWAYS = ("clevis_backlash", "fixture_compliance")
"""Effects whose gain is not linear in their size: a refit says more than this look."""
_TRIED = 10
"""Forms whose step is really taken."""
_PROMISING = 0.02
"""[1] part of the excess that a screening must promise."""
_FORMS_TIED = 0.7
"""[1] part of the best form's promise from which on another form of the same effect is fitted too."""
_SIZE_STEP, _LENGTH_STEP = 0.05, 0.03
"""[1] steps of the differences in search numbers: of sizes, and of logarithms."""


@dataclass(frozen=True)
class Gain:
    """What one form of an effect promises."""

    choice: EffectChoice
    gain: float
    """[1] part of the baseline's excess cost that the linear step takes away; at most one."""
    achieved: float
    """[1] part of it that the step really takes away, after a line search; the promise where it was not taken."""
    unknowns: Array
    """(U,) of the joint problem, where that was: a start of the refit."""


def every_choice(names: Sequence[str] = USUAL) -> tuple[EffectChoice, ...]:
    """Every form of the effects named."""
    return tuple(EffectChoice(name, form.name) for name in names for form in EFFECTS[name].forms)


def screen(
    problem: Problem,
    baseline: JointFit,
    effects: Sequence[EffectChoice] = (),
    thin: int = THIN,
    line: float = MAINS,
) -> list[Gain]:
    """The gain of every effect beside a baseline fit, the largest first.

    Args:
        problem: pieces, noise, priors.
        baseline: the fit so far, with or without effects.
        effects: forms to look at; every form of the usual effects if none is given.
        thin: looks at every so many samples.
        line: frequency of a hum [Hz], as ``strongest_line`` finds it.
    """
    chosen = effects or every_choice()
    quick = problem.with_effects(baseline.effects).coarser(thin)
    with one_thread():
        # The baseline was fitted on more samples: its own step here is no merit of an effect.
        first, _, _ = joint_step(quick, baseline.minimum.unknowns)
        frame = _Frame.at(quick, first.unknowns, line)
        looks = sorted((frame.best(choice) for choice in chosen), key=lambda g: -g.gain)
        found = [frame.taken(look) for look in looks[:_TRIED]] + looks[_TRIED:]
    return sorted(found, key=lambda g: -promise(g))


def worth_fitting(gains: Sequence[Gain], count: int) -> list[Gain]:
    """The most promising effects, each in its best form and in forms that promise nearly as much."""
    best: dict[str, list[Gain]] = {}
    for gain in gains:
        best.setdefault(gain.choice.name, []).append(gain)

    ranked = sorted(best, key=lambda name: -promise(best[name][0]))
    chosen = [n for n in ranked[:count] if promise(best[n][0]) > _PROMISING]
    return [
        gain
        for name in chosen
        for gain in best[name]
        if gain is best[name][0] or promise(gain) > _FORMS_TIED * promise(best[name][0])
    ]


def promise(gain: Gain) -> float:
    """Part of the excess that a screening holds possible [1]."""
    return max(gain.gain, gain.achieved)


@dataclass(frozen=True)
class _Frame:
    """The baseline with its slopes, beside which every effect is put."""

    problem: Problem
    unknowns: Array
    """(U,)"""
    here: Evaluation
    residuals: tuple[Array, ...]
    """(N,) of each piece, in units of the noise."""
    slopes: tuple[Array, ...]
    """(N, C) of each piece over its columns."""
    line: float
    """[Hz] at which a hum is looked for."""

    @staticmethod
    def at(problem: Problem, unknowns: Array, line: float) -> "_Frame":
        """The frame at a point."""
        both = [problem.residuals(unknowns, i) for i in range(len(problem.pieces))]
        here = problem.evaluate(unknowns)
        return _Frame(problem, unknowns, here, tuple(r for r, _ in both), tuple(J for _, J in both), line)

    @property
    def excess(self) -> float:
        """What the baseline leaves beyond the noise [1]."""
        return max(self.here.cost - self.problem.samples, 1.0)

    def best(self, choice: EffectChoice) -> Gain:
        """The most promising of a form's starts."""
        return max((self._promise(choice, values) for values in self._starts(choice)), key=lambda g: g.gain)

    def taken(self, look: Gain) -> Gain:
        """The step from there, really taken."""
        joint = self.problem.with_effects((*self.problem.effects, look.choice))
        point, _, promised = joint_step(joint, look.unknowns)
        gain = min((self.here.cost - promised) / self.excess, 1.0)
        return Gain(look.choice, gain, (self.here.cost - point.cost) / self.excess, point.unknowns)

    def _starts(self, choice: EffectChoice) -> Sequence[tuple[float, ...]]:
        """The form's own starts; a hum is looked for at one frequency."""
        if choice.name != "mains_hum":
            return choice.form.starts
        return [(*choice.form.starts[0][:-1], self.line)]

    def _promise(self, choice: EffectChoice, values: tuple[float, ...]) -> Gain:
        """What the linear step from a start takes away."""
        joint = self.problem.with_effects((*self.problem.effects, choice))
        begin = with_further(self.problem, self.unknowns, choice.to_search(values))
        here = self._beside(joint, begin, choice, values)
        promised = promised_step(joint, here, begin)[1]
        gain = min((self.here.cost - promised) / self.excess, 1.0)
        return Gain(choice, gain, gain, begin)

    def _beside(self, joint: Problem, begin: Array, choice: EffectChoice, values: tuple[float, ...]) -> Evaluation:
        """Cost, J'J and J'r of the joint problem at a start, the effect's slopes by differences."""
        first = self.problem.first_own
        own = np.arange(first, first + len(choice.quantities))
        others = np.setdiff1d(np.arange(len(begin)), own)
        absent = not any(v for v, q in zip(values, choice.quantities, strict=True) if q.low <= 0.0)
        moved = [self._weighed(joint, begin) if not absent else self.residuals]
        steps = [_step(joint, begin, int(place), absent) for place in own]
        moved += [self._weighed(joint, begin + s) if s.any() else moved[0] for s in steps]
        hessian, gradient = np.zeros((len(begin), len(begin))), np.zeros(len(begin))
        hessian[np.ix_(others, others)], gradient[others] = self.here.hessian, self.here.gradient
        cost = self.here.cost
        for i, (r, J) in enumerate(zip(self.residuals, self.slopes, strict=True)):
            columns, there = others[self.problem.columns(i)], moved[0][i]
            E = np.column_stack(
                [(m[i] - there) / max(s.sum(), 1e-12) for m, s in zip(moved[1:], steps, strict=True)]
            )
            cross = J.T @ E
            hessian[np.ix_(columns, own)] += cross
            hessian[np.ix_(own, columns)] += cross.T
            hessian[np.ix_(own, own)] += E.T @ E
            gradient[columns] += J.T @ (there - r)
            gradient[own] += E.T @ there
            cost += float(there @ there - r @ r)
        return Evaluation(cost if np.isfinite(cost) else np.inf, hessian, gradient)

    def _weighed(self, joint: Problem, unknowns: Array) -> tuple[Array, ...]:
        """(N,) residuals of each piece, in units of the noise."""
        forces = joint.simulate(unknowns)
        return tuple(
            p.train / joint.noise * (force - p.force) for p, force in zip(joint.pieces, forces, strict=True)
        )


def _step(joint: Problem, begin: Array, place: int, absent: bool) -> Array:
    """(U,) step of a difference over one parameter; none over a length of an effect that is not there."""
    step = np.zeros(len(begin))
    logarithmic = np.concatenate([e.logarithmic for e in joint.effects])[place - joint.first_effect]
    if logarithmic and absent:
        return step
    size = _LENGTH_STEP if logarithmic else _SIZE_STEP
    step[place] = size if begin[place] + size <= joint.bounds()[1][place] else -size
    return step

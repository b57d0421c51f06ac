"""A first look at every effect: by how much it would lower the cost, were the force linear in all unknowns.

Each form is put beside the baseline at its starts (none of it, but with several lengths, speeds or times; or a
little of it, where none would show nothing). One Gauss-Newton step moves the law's coordinates and the effect
together, inside their bounds, so that what the coordinates could have done alone does not count.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from identification.arrays import Array
from identification.damper.effects import EFFECTS, USUAL
from identification.effect_choice import EffectChoice
from identification.gap.explain import JointFit, joint_step
from identification.gap.hum import strongest_line
from identification.problem import Problem

THIN = 4
"""Every so many samples that a screening looks at."""
ALWAYS = ("clevis_backlash", "fixture_compliance")
"""Effects whose gain is not linear in their size: a refit says more than this look."""


@dataclass(frozen=True)
class Gain:
    """What one form of an effect promises."""

    choice: EffectChoice
    gain: float
    """[1] part of the baseline's excess cost that the linear step takes away; at most one."""
    achieved: float
    """[1] part of it that the step really takes away, after a line search."""
    unknowns: Array
    """(U,) of the joint problem, where that was: a start of the refit."""

    @property
    def values(self) -> tuple[float, ...]:
        """Parameters there [SI]."""
        return self.choice.to_values(self.unknowns[len(self.unknowns) - len(self.choice.quantities) :])


def every_choice(names: Sequence[str] = USUAL) -> tuple[EffectChoice, ...]:
    """Every form of the effects named."""
    return tuple(EffectChoice(name, form.name) for name in names for form in EFFECTS[name].forms)


def screen(
    problem: Problem, baseline: JointFit, effects: Sequence[EffectChoice] = (), thin: int = THIN
) -> list[Gain]:
    """The gain of every effect beside a baseline fit, the largest first.

    Args:
        problem: pieces, noise, priors.
        baseline: the fit so far, with or without effects.
        effects: forms to look at; every form of the usual effects if none is given.
        thin: looks at every so many samples.
    """
    quick = problem.with_effects(baseline.effects).quicker().coarser(thin)
    known = {choice.name for choice in baseline.effects}
    chosen = [c for c in (effects or every_choice()) if c.name not in known]
    with threadpool_limits(1, "blas"):
        first, _, _ = joint_step(quick, baseline.minimum.unknowns)
        found = [_best(quick, first.unknowns, first.cost, choice) for choice in chosen]
    return sorted(found, key=lambda g: -max(g.gain, g.achieved))


def _best(problem: Problem, unknowns: Array, cost: float, choice: EffectChoice) -> Gain:
    """The best of a form's starts."""
    excess = max(cost - problem.samples, 1.0)
    joint = problem.with_effects((*problem.effects, choice))
    gains = []
    for values in _starting_values(problem, unknowns, choice):
        point, _, promised = joint_step(joint, np.concatenate([unknowns, choice.to_search(values)]))
        gain = min((cost - promised) / excess, 1.0)
        gains.append(Gain(choice, gain, (cost - point.cost) / excess, point.unknowns))
    return max(gains, key=lambda g: (max(g.achieved, 0.0), g.gain))


def _starting_values(problem: Problem, unknowns: Array, choice: EffectChoice) -> Sequence[tuple[float, ...]]:
    """The form's own starts; a hum's frequency is that of the strongest line in what the baseline leaves."""
    if choice.name != "mains_hum":
        return choice.form.starts
    return [(*choice.form.starts[0][:-1], strongest_line(problem, unknowns))]

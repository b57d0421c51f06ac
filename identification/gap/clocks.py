"""Clocks of a bench that wander within what its log says of them: what that leaves is no gap.

Between two devices on wires the delay changes by some hundredths of a millisecond over seconds. No fit of one
delay follows that, and a law that is right stands a few per cent above the floor. Where all of it goes away once
the delay may bend that far, nothing is looked for; an effect of a damper stays.
"""

from dataclasses import replace

import numpy as np

from identification.clock_wander import bent_away
from identification.gap.contender import Contender
from identification.gap.judge import Judge
from identification.problem import Problem


def steadied(contender: Contender, full: Problem, judge: Judge, spread: float) -> tuple[Contender, float]:
    """A set with what wandering clocks make of its residual taken away, on fitted and other strokes.

    Args:
        contender: the set.
        full: the problem of all samples.
        judge: of the recordings.
        spread: to which the clocks are known [s], one deviation.

    Returns:
        The set, and how far the delay bends [s].
    """
    problem = replace(full.with_effects(contender.fit.effects), pieces=judge.pieces)
    added, wander = bent_away(problem, contender.fit.minimum.unknowns, spread)
    # A residual of the problem is simulated less recorded, over the noise.
    left = replace(contender.left, residual=contender.left.residual - problem.noise * np.concatenate(added))
    seen, unseen = judge.rmse(left)
    return replace(contender, left=left, seen=seen, unseen=unseen), wander


def nothing_but_clocks(wander: float) -> str:
    """What a person should know of a wander [s] that is all that was left."""
    return (
        f"the delay of the force wanders by {1e6 * wander:.2g} µs within the run, no more than its log says of "
        "the clocks; that is taken away, and nothing else is left above the floor"
    )

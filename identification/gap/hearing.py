"""What counts as noise while sets are fitted: it is learnt from what they leave.

It begins with the white noise of the recorded force. What the motion carries into the simulation is added, and
where a residual shows that the noise is not white but steady, all of it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from identification.gap.carried import carried_noise, replayed
from identification.gap.colour import floor_under
from identification.gap.contender import Contender
from identification.gap.judge import Judge
from identification.problem import Piece, Problem
from identification.recordings import Stretch

NOTHING = 1.008
"""[1] RMSE over the floor up to which nothing is looked for."""
_COLOURED = 1.02
"""[1] noise over the floor so far from which on it is coloured."""


@dataclass
class Hearing:
    """Noise of force and motion, as far as it has been heard."""

    noise: float
    """[N] of the recorded force: the white one, or a coloured one once a residual has shown it."""
    stretches: Sequence[Stretch]
    """As recorded, one a piece."""
    seed: int = 1
    """Of the noise of the motion that is played again."""
    carried: float | None = None
    """[N] noise of the displacement, carried into the force; None before it was looked for."""
    _replays: list[tuple[Piece, ...]] = field(default_factory=list)

    @property
    def floor(self) -> float:
        """[N] noise of the recorded force, and of the motion carried into it."""
        return math.hypot(self.noise, self.carried or 0.0)

    def listen(self, contender: Contender, full: Problem, judge: Judge) -> None:
        """Raise the floor to what a set leaves, as far as that is noise, of the motion or not white.

        Args:
            contender: the best set so far; the law alone comes first.
            full: the problem of all samples.
            judge: of the same samples.
        """
        if max(contender.seen, contender.unseen) < NOTHING * self.noise:
            return
        if not self._replays:
            edges = np.cumsum([len(p.force) for p in full.pieces])[:-1]
            forces = np.split(contender.left.simulated, edges)
            self._replays = replayed(self.stretches, full.pieces, forces, self.noise, self.seed)
        problem = full.with_effects(contender.fit.effects)
        carried = carried_noise(problem, contender.fit.minimum.unknowns, self._replays)
        # Under a wrong law the loop may be far too steep: what is carried least is what is sure.
        self.carried = carried if self.carried is None else min(carried, self.carried)
        heard = floor_under(contender.left, judge.cycles)
        if heard is not None and heard > _COLOURED * self.floor:
            self.noise = math.sqrt(heard**2 - self.carried**2)

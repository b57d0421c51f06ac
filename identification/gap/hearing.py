"""What counts as noise while sets are fitted: it is learnt from what they leave.

It begins with the white noise of the recorded force. What the motion carries into the simulation is added, and
where a residual shows that the noise is not white but steady, all of it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from identification.arrays import Array
from identification.gap.carried import carried, replayed
from identification.gap.colour import floor_under
from identification.gap.contender import Contender
from identification.gap.judge import Judge
from identification.gap.residual import by_piece
from identification.piece import Piece
from identification.problem import Problem
from identification.recordings import Stretch

NOTHING = 1.008
"""[1] RMSE over the floor up to which nothing is looked for."""
_COLOURED = 1.02
"""[1] noise over the floor so far from which on it is coloured."""
_FEW, _MANY = 2, 8
"""Times the noise of the motion is played again: each knows its size to a few hundredths where the damper moves;
at rest, where a run begins, they differ by more than their mean."""


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
    white: float = field(init=False)
    """[N] the noise it began with."""
    _replays: list[tuple[Piece, ...]] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Keep the white noise."""
        self.white = self.noise

    @property
    def floor(self) -> float:
        """[N] noise of the recorded force, and of the motion carried into it."""
        return math.hypot(self.noise, self.carried or 0.0)

    @property
    def colour(self) -> float:
        """[1] part of the noise's variance that is not white."""
        return 1.0 - (self.white / self.noise) ** 2

    def listen(self, contender: Contender, full: Problem, judge: Judge) -> None:
        """Raise the floor to what a set leaves, as far as that is noise, of the motion or not white.

        Args:
            contender: the best set so far; the law alone comes first.
            full: the problem of all samples.
            judge: of the same samples.
        """
        if max(contender.seen, contender.unseen) < NOTHING * self.noise:
            return
        squares = self._carried(contender, full, _FEW)[:, judge.seen]
        size = math.sqrt(float(squares.mean()))
        # Under a wrong law the loop may be far too steep: what is carried least is what is sure.
        self.carried = size if self.carried is None else min(size, self.carried)
        heard = floor_under(contender.left, judge.cycles)
        if heard is not None and heard > _COLOURED * self.floor:
            self.noise = math.sqrt(heard**2 - self.carried**2)

    def noise_under(self, contender: Contender) -> float:
        """[N] of the recorded force: no more than a set leaves that was fitted in full after it was heard."""
        left = contender.left.residual[contender.left.valid]
        most = math.sqrt(max(float(np.mean(left**2)) - (self.carried or 0.0) ** 2, 0.0))
        return max(min(self.noise, most), self.white)

    def other_runs(self, contender: Contender, full: Problem) -> Array:
        """(runs, N) squared change [N²] of the force of a set, as the noise of other runs' motion makes it.

        Args:
            contender: the set.
            full: the problem of all samples.
        """
        return self._carried(contender, full, _MANY)

    def _carried(self, contender: Contender, full: Problem, draws: int) -> Array:
        if len(self._replays) < draws:
            forces = by_piece(contender.left.simulated, full.pieces)
            missing = range(len(self._replays), draws)
            self._replays += replayed(self.stretches, full.pieces, forces, self.noise, self.seed, missing)
        problem = full.with_effects(contender.fit.effects)
        return carried(problem, contender.fit.minimum.unknowns, self._replays[:draws])

"""A set of effects that was fitted, and what it leaves of the gap."""

from dataclasses import dataclass

from identification.gap.explain import JointFit
from identification.gap.where import Left

_OPEN = 1.1
"""[1] RMSE over the floor from which on the gap on one side is large enough to speak of shares of it."""


@dataclass(frozen=True)
class Contender:
    """A set of effects, fitted."""

    fit: JointFit
    left: Left
    """What it leaves of the force, on all samples."""
    seen: float
    """[N] RMSE on the fitted strokes."""
    unseen: float
    """[N] on those kept out."""
    chance: float
    """[1] excess on those kept out that chance may show."""

    @property
    def names(self) -> frozenset[str]:
        """Of its effects."""
        return frozenset(choice.name for choice in self.fit.effects)

    def share_of(self, none: "Contender", floor: float) -> float:
        """Its excess [1], as the worse share of the gap on seen and on unseen strokes.

        The gap itself may be larger on one side; a set that hides it on seen strokes alone must not gain by it.
        """
        whole = none.excess(floor)
        sides = [(self.seen, none.seen, 0.0), (self.unseen, none.unseen, self.chance * floor**2)]
        shares = [(r**2 - floor**2 - by) / (p**2 - floor**2) for r, p, by in sides if p > _OPEN * floor]
        return max(shares) * whole if len(shares) == len(sides) else self.excess(floor)

    def excess(self, floor: float) -> float:
        """What it leaves beyond the floor's variance [1], the worse of seen and unseen strokes beyond chance."""
        return max((self.seen / floor) ** 2, (self.unseen / floor) ** 2 - self.chance) - 1.0

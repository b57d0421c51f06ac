"""Do two stages that know nothing of each other find the same damper?

Both look at the same samples, so two good estimates differ by less than either misses the truth. A dozen
coordinates are compared, so the largest of their differences is judged: one in twenty beyond two deviations
would be an alarm on every other run.
"""

from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.damper.coordinates import Coordinates

AGREE = 2.9
"""[1] deviations up to which two values count as the same: 95 % of the largest of a dozen lie below."""


@dataclass(frozen=True)
class Agreement:
    """How far two estimates of the coordinates lie apart."""

    deviations: dict[str, float]
    """[1] difference of each coordinate over the larger of the two standard deviations."""

    @property
    def worst(self) -> str:
        """The coordinate that differs most."""
        return max(self.deviations, key=lambda name: self.deviations[name])

    @property
    def agrees(self) -> bool:
        """Whether no coordinate differs by more than chance lets the largest of them."""
        return all(value <= AGREE for value in self.deviations.values())

    def words(self) -> str:
        """In a sentence for a person."""
        if not self.deviations:
            return "nothing to compare: no coordinate is known to both stages"
        worst = f"{self.worst} by {self.deviations[self.worst]:.2g} deviations"
        if self.agrees:
            return f"agree: pinn and refine differ most in {worst}"
        apart = [name for name, value in self.deviations.items() if value > AGREE]
        return (
            f"disagree in {', '.join(apart)}, most in {worst}: the law lacks something, or a stage has gone "
            "astray; trust neither interval there"
        )


def compare(
    a: Coordinates, a_deviations: Array, b: Coordinates, b_deviations: Array, known: set[str]
) -> Agreement:
    """Compare two estimates.

    Args:
        a: one estimate.
        a_deviations: (13,) its standard deviations; NaN where none are known.
        b: the other.
        b_deviations: (13,) its own.
        known: names of the coordinates that the strokes fix at all.
    """
    found = {}
    for i, name in enumerate(Coordinates._fields):
        spread = float(np.fmax(a_deviations[i], b_deviations[i]))
        if name in known and spread > 0.0:
            found[name] = abs(a[i] - b[i]) / spread
    return Agreement(found)

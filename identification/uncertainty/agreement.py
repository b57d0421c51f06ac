"""Agreement of two independent estimates of the same damper.

Both stages read the same samples, so two good estimates differ by less than either differs from the truth. About a
dozen coordinates are compared, so the limit holds for the largest difference. One comparison in twenty beyond two
deviations would cause an alarm in every other run.
"""

from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.damper import Coordinates

MAX_DEVIATION = 2.9
"""Limit on the largest of a dozen differences, in standard deviations [1]: 95 % of them are below it by chance."""


@dataclass(frozen=True)
class Agreement:
    """Differences between two estimates of the coordinates."""

    deviations: dict[str, float]
    """Difference of each coordinate over the larger of the two standard deviations [1]."""

    @property
    def worst_coordinate(self) -> str:
        """Coordinate with the largest difference."""
        return max(self.deviations, key=lambda name: self.deviations[name])

    @property
    def is_consistent(self) -> bool:
        """True if the largest difference is within the limit that chance explains."""
        return all(value <= MAX_DEVIATION for value in self.deviations.values())

    def describe(self) -> str:
        """Return the comparison as one sentence for a person."""
        if not self.deviations:
            return "nothing to compare: no coordinate is known to both stages"
        worst = f"{self.worst_coordinate} by {self.deviations[self.worst_coordinate]:.2g} deviations"
        if self.is_consistent:
            return f"agree: pinn and refine differ most in {worst}"
        inconsistent = [name for name, value in self.deviations.items() if value > MAX_DEVIATION]
        return (
            f"disagree in {', '.join(inconsistent)}, most in {worst}: an effect is missing from the law, or one "
            "stage did not find the optimum; do not rely on either interval there"
        )


def compare_estimates(
    a: Coordinates, a_deviations: Array, b: Coordinates, b_deviations: Array, observable: set[str]
) -> Agreement:
    """Compare two estimates.

    Args:
        a: one estimate.
        a_deviations: (13,) its standard deviations; NaN where unknown.
        b: the other estimate.
        b_deviations: (13,) its standard deviations.
        observable: names of the coordinates on which the recorded force depends.
    """
    deviations = {}
    for i, name in enumerate(Coordinates._fields):
        scale = float(np.fmax(a_deviations[i], b_deviations[i]))
        if name in observable and scale > 0.0:
            deviations[name] = abs(a[i] - b[i]) / scale
    return Agreement(deviations)

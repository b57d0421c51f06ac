"""Candidate: a set of effects fitted to the recording, with its errors on fitted and held-out samples."""

from dataclasses import dataclass

from identification.gap.data import Residual
from identification.gap.fits.joint_fit import JointFit

NO_GAP_RATIO = 1.008
"""Threshold on the RMSE relative to the noise floor: below it, there is no gap."""
EXPLAINED_RATIO = 1.05
"""Threshold on the RMSE with effects relative to the noise floor: below it, they explain the gap."""
_MIN_GAP_RATIO = 1.1
"""Threshold on the baseline's RMSE relative to the noise floor: above it, shares of the gap are meaningful."""


@dataclass(frozen=True)
class Candidate:
    """A set of effects fitted to the recording together with the law."""

    fit: JointFit
    residual: Residual
    """Residual on all samples."""
    train_rmse: float
    """RMSE on the fitted samples [N]."""
    held_out_rmse: float
    """RMSE on the held-out samples [N]."""
    chance_excess: float
    """Excess on the held-out samples that sampling alone can produce [1]."""

    @property
    def names(self) -> frozenset[str]:
        """Names of the effects."""
        return frozenset(model.name for model in self.fit.effects)

    def compute_relative_excess(self, baseline: "Candidate", floor: float) -> float:
        """Compute the excess [1], scaled by that of the baseline on the worse of fitted and held-out samples.

        The gap can be larger on one of the two. A set that closes it on the fitted samples alone must not gain.
        """
        baseline_excess = baseline.compute_excess(floor)
        splits = [
            (self.train_rmse, baseline.train_rmse, 0.0),
            (self.held_out_rmse, baseline.held_out_rmse, self.chance_excess * floor**2),
        ]
        shares = [
            (rmse**2 - floor**2 - chance) / (before**2 - floor**2)
            for rmse, before, chance in splits
            if before > _MIN_GAP_RATIO * floor
        ]
        return max(shares) * baseline_excess if len(shares) == len(splits) else self.compute_excess(floor)

    def compute_excess(self, floor: float) -> float:
        """Compute the excess relative to the floor's variance [1], on the worse of fitted and held-out samples."""
        return max((self.train_rmse / floor) ** 2, (self.held_out_rmse / floor) ** 2 - self.chance_excess) - 1.0

    def reaches_floor(self, floor: float) -> bool:
        """Return True if the error on fitted and, within chance, on held-out samples is nearly the noise floor."""
        return self.compute_excess(floor) < EXPLAINED_RATIO**2 - 1.0

"""Noise floor where no cycles repeat: the residual that no function of stroke, drive and time predicts.

Without repeated cycles, only the noise at high frequencies is known, which slow noise exceeds. The error of a
fitted model is an upper bound. A flexible regression decides between them: if it predicts nothing of the residual
on strokes that it has not seen, the residual is noise.
"""

from collections.abc import Collection

from identification.gap.fits import EXPLAINED_RATIO, Candidate
from identification.gap.noise.explainable_share import ResidualRegression
from identification.gap.noise.noise_model import NoiseModel


def settle_unknown_floor(
    noise_model: NoiseModel, candidates: Collection[Candidate], regression: ResidualRegression
) -> None:
    """Take the floor from the smallest set of effects whose residual is noise; change nothing if there is none.

    The residual of a set is noise if neither the regression nor another set has a materially smaller error. White
    noise needs no such estimate: a set that reaches the noise at high frequencies shows it.

    Args:
        noise_model: its floor is replaced.
        candidates: the fitted sets, the law included.
        regression: regression on their residuals on held-out strokes.
    """
    if noise_model.estimate.is_known:
        return
    lowest = regression.find_explainable_rmse(_select_best(candidates), noise_model.floor)
    if lowest < EXPLAINED_RATIO * noise_model.floor:
        return
    adequate = [c for c in candidates if c.held_out_rmse < EXPLAINED_RATIO * lowest]
    if adequate:
        chosen = min(adequate, key=lambda c: (len(c.names), c.held_out_rmse))
        noise_model.take_residual(chosen)


def _select_best(candidates: Collection[Candidate]) -> list[Candidate]:
    """Return the law and the set with the smallest error."""
    law = [c for c in candidates if not c.names]
    return [*law, min(candidates, key=lambda c: c.held_out_rmse)]

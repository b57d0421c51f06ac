"""Uncertainty of a predicted force, sample by sample, and its 95 % band.

Two sources are combined: the covariance of the fit's coordinates, propagated to the force by exact sensitivities,
and the noise of the recorded force. The misfit of the fit beyond its noise floor occurs on other strokes, too, and
counts as noise. Each log has its own channel delays, known to the accuracy of its clocks.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from identification.arrays import Array
from identification.damper import COORDINATES
from identification.documents import Band, Fit
from identification.fitting import Piece, PiecePrediction, make_piece_model
from identification.simulate import SENSITIVITY_COLUMNS
from identification.uncertainty import Z95

if TYPE_CHECKING:
    from identification.fitting import DamperModel

CONFIDENCE_LEVEL = 0.95
"""Probability of the band [1]."""
_DELAYS = [SENSITIVITY_COLUMNS.index("force_delay"), SENSITIVITY_COLUMNS.index("drive_delay")]
_TEST_CHANGE = 0.1
"""Change of an unobservable coordinate, over its usual scale, that tests its influence on the force [1]."""
_MIN_VISIBILITY = 0.5
"""Threshold on the force change by the test change, over the noise [1]: above it, the strokes depend on it."""
_RANGE_MARGIN = 0.05
"""Margin around the fit's range of drives, over its width [1]: beyond it, a drive counts as outside."""


@dataclass(frozen=True)
class ForceUncertainty:
    """Standard deviations of the predicted force of one stretch [N]."""

    parameters: Array
    """(N,) part that uncertain coordinates and delays cause."""
    noise: float
    """Noise of the recorded force, misfit included."""

    @property
    def total(self) -> Array:
        """(N,) both parts combined."""
        return np.asarray(np.hypot(self.parameters, self.noise))


def estimate_record_noise(fit: Fit, floor: float | None) -> float:
    """Return the expected noise of a recorded force [N]: a noise floor and the fit's misfit beyond its own floor.

    Args:
        fit: fit from which the force is predicted.
        floor: noise floor of the record [N]; None takes that of the fit.
    """
    misfit = max(fit.rmse_n.train**2 - fit.noise_floor_n**2, 0.0)
    return float(np.sqrt((fit.noise_floor_n if floor is None else floor) ** 2 + misfit))


def estimate_force_uncertainty(
    fit: Fit, model: "DamperModel", piece: Piece, prediction: PiecePrediction, noise: float
) -> ForceUncertainty:
    """Estimate the uncertainty of the predicted force of one stretch; ``noise`` is that of the recorded force [N].

    The model is the fit as it was simulated. Without a covariance of the fit, its coordinates add nothing.
    """
    sensitivities = _compute_sensitivities(model, piece, prediction)
    count = len(COORDINATES)
    covariance = np.zeros((count, count)) if fit.covariance is None else np.array(fit.covariance)
    variance = np.einsum("ij,jk,ik->i", sensitivities[:, :count], covariance, sensitivities[:, :count])
    # Each log has its own delays. The delays that the fit found on other logs add nothing to their prior here.
    prior = np.array([fit.nuisances.force_delay.prior_sd, fit.nuisances.drive_delay.prior_sd])
    variance += ((sensitivities[:, _DELAYS] * prior) ** 2).sum(axis=1)
    # Rounding may make a variance of zero slightly negative.
    return ForceUncertainty(np.sqrt(np.maximum(variance, 0.0)), noise)


def _compute_sensitivities(model: "DamperModel", piece: Piece, prediction: PiecePrediction) -> Array:
    simulated = make_piece_model(piece, model.coordinates, model.delays, prediction.y0, model.effects)
    return piece.simulate(simulated, sensitivities=True)[1]


def make_band(
    fit: Fit,
    uncertainties: Sequence[ForceUncertainty],
    errors: Sequence[Array] | None,
    drives: Sequence[Array],
    unobserved: set[str],
) -> Band:
    """Summarise the band of a prediction.

    Args:
        fit: fit from which the force is predicted.
        uncertainties: uncertainty of each stretch.
        errors: force error (N,) [N] of each stretch at its samples; None where nothing was recorded.
        drives: drive (N,) of each stretch [V or A].
        unobserved: coordinates that the fit did not observe and on which these strokes depend.
    """
    total = np.concatenate([u.total for u in uncertainties])
    coverage = None
    if errors is not None:
        inside = np.concatenate([np.abs(e) <= Z95 * u.total for e, u in zip(errors, uncertainties, strict=True)])
        coverage = float(inside.mean())
    return Band(
        level=CONFIDENCE_LEVEL,
        half_width_n=float(Z95 * np.median(total)),
        widest_n=float(Z95 * total.max()),
        noise_n=float(np.sqrt(np.mean([u.noise**2 for u in uncertainties]))),
        parameters_n=float(np.sqrt(np.mean(np.concatenate([u.parameters for u in uncertainties]) ** 2))),
        coverage=coverage,
        note=_describe_limitations(fit, drives, unobserved),
    )


def make_residual_band(deviations: Sequence[Array], rest: float, errors: Sequence[Array]) -> Band:
    """Summarise the band of a twin with a learned residual.

    Args:
        deviations: standard deviation (N,) [N] of the residual of each stretch.
        rest: standard deviation of what the residual does not predict, noise included [N].
        errors: force error (N,) [N] of each stretch.
    """
    residual, error = np.concatenate(deviations), np.concatenate(errors)
    total = np.hypot(residual, rest)
    return Band(
        level=CONFIDENCE_LEVEL,
        half_width_n=float(Z95 * np.median(total)),
        widest_n=float(Z95 * total.max()),
        noise_n=rest,
        parameters_n=float(np.sqrt(np.mean(residual**2))),
        coverage=float(np.mean(np.abs(error) <= Z95 * total)),
        note="estimated from the errors on stroke conditions that the learned residual had not read",
    )


def find_unobserved_active(
    fit: Fit, model: "DamperModel", piece: Piece, prediction: PiecePrediction, noise: float
) -> set[str]:
    """Return coordinates without an interval in the fit on which the force of these strokes depends."""
    unobserved = [i for i, q in enumerate(COORDINATES) if fit.coordinates[q.symbol].ci95 is None]
    if not unobserved:
        return set()
    sensitivities = _compute_sensitivities(model, piece, prediction)
    return {
        COORDINATES[i].symbol
        for i in unobserved
        if np.sqrt(np.mean((sensitivities[:, i] * _TEST_CHANGE * COORDINATES[i].scale) ** 2))
        > _MIN_VISIBILITY * noise
    }


def compute_limits(force: Array, uncertainty: ForceUncertainty) -> tuple[Array, Array]:
    """Return lower and upper limit (N,) [N] of the band about a simulated force (N,)."""
    return force - Z95 * uncertainty.total, force + Z95 * uncertainty.total


def _describe_limitations(fit: Fit, drives: Sequence[Array], unobserved: set[str]) -> str:
    notes = []
    if fit.covariance is None:
        notes.append("the fit has no covariance (older document): the band contains noise only")
    if unobserved:
        notes.append(
            f"the fit did not observe {', '.join(sorted(unobserved))}, on which these strokes depend: the error "
            "may exceed the band"
        )
    low, high = fit.drive_range
    margin = _RANGE_MARGIN * max(high - low, 1e-9)
    lowest, highest = min(float(d.min()) for d in drives), max(float(d.max()) for d in drives)
    if lowest < low - margin or highest > high + margin:
        notes.append(
            f"driven from {lowest:.3g} to {highest:.3g} {fit.drive_unit}, fitted from {low:.3g} to {high:.3g}: "
            "outside that range the law is extrapolated linearly in the drive"
        )
    return "; ".join(notes)

"""How far a prediction may be off, sample by sample.

Two things are uncertain: the damper, by the covariance of its coordinates carried on to the force through the
exact slopes, and the record, by the noise of its load cell. What the fit itself left beyond its noise floor is
misfit that comes again on other strokes, and counts as noise. Each log has channel delays of its own, known as
well as its clocks were mapped.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from identification.arrays import Array
from identification.damper.coordinates import COORDINATES
from identification.piece import Piece
from identification.prediction import Predicted, piece_setting
from identification.results import Band, Fit
from identification.simulate import UNKNOWNS

if TYPE_CHECKING:
    from identification.gap.model import Model

LEVEL = 0.95
_Z = 1.959964
_DELAYS = [UNKNOWNS.index("force_delay"), UNKNOWNS.index("drive_delay")]
_SHOWS = 0.5
"""[1] of the noise: force change by a tenth of an unseen coordinate that makes the strokes show it."""
_TENTH = 0.1
_OUTSIDE = 0.05
"""[1] of the drives' range beyond which a log's drive counts as outside."""


@dataclass(frozen=True)
class Spread:
    """Standard deviations of one stretch's force, (N,) [N] each."""

    parameters: Array
    """Because the damper and the delays are known only so well."""
    noise: float
    """[N] of the record, misfit included."""

    @property
    def total(self) -> Array:
        """Both together."""
        return np.asarray(np.hypot(self.parameters, self.noise))


def record_noise(fit: Fit, floor: float | None) -> float:
    """Noise [N] to expect of a record: its own floor where known, and the misfit that the fit had beyond its."""
    misfit = max(fit.rmse_n.train**2 - fit.noise_floor_n**2, 0.0)
    return float(np.sqrt((fit.noise_floor_n if floor is None else floor) ** 2 + misfit))


def force_spread(fit: Fit, model: "Model", piece: Piece, found: Predicted, noise: float) -> Spread:
    """How far the force of one stretch may be off.

    Args:
        fit: with the covariance of its coordinates; one without gives only the noise.
        model: the same as it was simulated.
        piece: the stretch.
        found: its simulated force, with y(0).
        noise: of the record [N].
    """
    setting = piece_setting(piece, model.point, model.delays, found.y0, model.effects)
    slopes = piece.recorded(setting, slopes=True)[1]
    count = len(COORDINATES)
    known = np.zeros((count, count)) if fit.covariance is None else np.array(fit.covariance)
    variance = np.einsum("ij,jk,ik->i", slopes[:, :count], known, slopes[:, :count])
    prior = np.array([fit.nuisances.force_delay.prior_sd, fit.nuisances.drive_delay.prior_sd])
    # Each log has delays of its own: what the fit found of them on others says no more here than their prior.
    variance += ((slopes[:, _DELAYS] * prior) ** 2).sum(axis=1)
    # Where nothing is uncertain, rounding may leave less than zero.
    return Spread(np.sqrt(np.maximum(variance, 0.0)), noise)


def band(
    fit: Fit, spreads: Sequence[Spread], errors: Sequence[Array] | None, drives: Sequence[Array], unseen: set[str]
) -> Band:
    """The band in short.

    Args:
        fit: behind the prediction.
        spreads: of each stretch.
        errors: force error (N,) [N] of each stretch at its samples; None where nothing was recorded.
        drives: (N,) [V or A] of each stretch.
        unseen: coordinates that the fit never saw and these strokes show.
    """
    total = np.concatenate([s.total for s in spreads])
    inside = None
    if errors is not None:
        within = np.concatenate([np.abs(e) <= _Z * s.total for e, s in zip(errors, spreads, strict=True)])
        inside = float(within.mean())
    return Band(
        level=LEVEL,
        half_width_n=float(_Z * np.median(total)),
        widest_n=float(_Z * total.max()),
        noise_n=float(np.sqrt(np.mean([s.noise**2 for s in spreads]))),
        parameters_n=float(np.sqrt(np.mean(np.concatenate([s.parameters for s in spreads]) ** 2))),
        inside=inside,
        note=_note(fit, drives, unseen),
    )


def shown_but_unseen(fit: Fit, model: "Model", piece: Piece, found: Predicted, noise: float) -> set[str]:
    """Coordinates without an interval in the fit whose change by a tenth these strokes would show."""
    blind = [i for i, q in enumerate(COORDINATES) if fit.coordinates[q.symbol].ci95 is None]
    if not blind:
        return set()
    setting = piece_setting(piece, model.point, model.delays, found.y0, model.effects)
    slopes = piece.recorded(setting, slopes=True)[1]
    return {
        COORDINATES[i].symbol
        for i in blind
        if np.sqrt(np.mean((slopes[:, i] * _TENTH * COORDINATES[i].scale) ** 2)) > _SHOWS * noise
    }


def limits(force: Array, spread: Spread) -> tuple[Array, Array]:
    """Lower and upper end (N,) [N] of the band about a simulated force (N,)."""
    return force - _Z * spread.total, force + _Z * spread.total


def _note(fit: Fit, drives: Sequence[Array], unseen: set[str]) -> str:
    words = []
    if fit.covariance is None:
        words.append("the fit carries no covariance (it is older): the band holds noise alone")
    if unseen:
        words.append(
            f"the fit never saw {', '.join(sorted(unseen))}, and these strokes show it: the force may be off more"
        )
    low, high = fit.drive_range
    margin = _OUTSIDE * max(high - low, 1e-9)
    least, most = min(float(d.min()) for d in drives), max(float(d.max()) for d in drives)
    if least < low - margin or most > high + margin:
        words.append(
            f"driven from {least:.3g} to {most:.3g} {fit.drive_unit}, fitted from {low:.3g} to {high:.3g}: "
            "outside that the law's straight lines are a guess"
        )
    return "; ".join(words)

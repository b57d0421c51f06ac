"""A fit, a twin or a scenario on another log: how well does it repeat the force there?"""

from collections.abc import Sequence
from importlib.metadata import version

import numpy as np

from identification.arrays import Array
from identification.assemble import Assembled, HoldOut, assemble
from identification.bands import Spread, band, force_spread, limits, record_noise, shown_but_unseen
from identification.gap.model import Model, model_of_fit
from identification.prediction import Predicted, normalised, per_drive, rmse
from identification.recordings import Recording
from identification.results import Band, Fit, Prediction, Provenance
from identification.series import Series

_NEAR_FLOOR = 1.02
"""[1] RMSE over the floor below which there is no gap to shrink."""


def predict_log(fit: Fit | Model, recording: Recording, *, free_offset: bool = False) -> tuple[Prediction, Series]:
    """Simulate a fit, or a model from any other document, on a log.

    Args:
        fit: the damper, with the lags of its bench.
        recording: the log; where the fit saw it, what was held out then is held out here.
        free_offset: also estimate a constant force for each stretch.

    Returns:
        The errors, and recorded beside simulated force.
    """
    model = model_of_fit(fit) if isinstance(fit, Fit) else fit
    # By content: a log that was copied or renamed is still one that the fit saw.
    seen = isinstance(fit, Fit) and recording.sha256 in fit.provenance.logs.values()
    assembled = assemble([recording], _held_out_in(fit) if seen and isinstance(fit, Fit) else HoldOut())
    found = [model.on(p, free_offset=free_offset) for p in assembled.pieces]
    measured = [s.counts for s in assembled.stretches]
    errors = [(f.force - p.force)[m] for f, p, m in zip(found, assembled.pieces, measured, strict=True)]
    forces = [p.force[m] for p, m in zip(assembled.pieces, measured, strict=True)]
    drives = [p.stroke.drive[m] for p, m in zip(assembled.pieces, measured, strict=True)]
    error, force = np.concatenate(errors), np.concatenate(forces)
    before = _before(model, assembled, free_offset)
    floor = assembled.floor.noise
    spreads = _spreads(fit, model, assembled, found) if isinstance(fit, Fit) else None
    prediction = Prediction(
        rmse_n=rmse(error),
        nrmse=normalised(error, force),
        bias_n=float(error.mean()),
        noise_floor_n=floor,
        per_drive=per_drive(drives, errors, forces, assembled.drive_unit),
        samples=len(error),
        freed=["y0 of each stretch"] + (["force offset of each stretch"] if free_offset else []),
        before_n=before,
        shrinkage=None if before is None else _shrinkage(before, rmse(error), floor),
        band=_band(fit, model, assembled, found, spreads) if isinstance(fit, Fit) and spreads else None,
        provenance=Provenance(
            logs={recording.path.name: recording.sha256},
            version=version("mrbench"),
            seed=fit.provenance.seed if isinstance(fit, Fit) else 0,
            settings={"free": "offset" if free_offset else None, "log_seen_by_fit": seen},
        ),
    )
    held = assembled.held_out if seen else [np.ones(len(p.force), bool) for p in assembled.pieces]
    series = Series(
        time=np.concatenate([s.time for s in assembled.stretches]),
        displacement=np.concatenate([p.stroke.displacement for p in assembled.pieces]),
        velocity=np.concatenate([p.stroke.velocity for p in assembled.pieces]),
        drive=np.concatenate([p.stroke.drive for p in assembled.pieces]),
        force=np.concatenate([p.force for p in assembled.pieces]),
        simulated=np.concatenate([f.force for f in found]),
        stretch=np.repeat(np.arange(len(found)), [len(p.force) for p in assembled.pieces]),
        held_out=np.concatenate(held),
        names=tuple(p.name for p in assembled.pieces),
        drive_unit=assembled.drive_unit,
        band=_ends(found, spreads) if spreads else None,
    )
    return prediction, series


def _spreads(fit: Fit, model: Model, assembled: Assembled, found: Sequence[Predicted]) -> list[Spread]:
    noise = record_noise(fit, assembled.floor.noise)
    return [force_spread(fit, model, p, f, noise) for p, f in zip(assembled.pieces, found, strict=True)]


def _band(
    fit: Fit, model: Model, assembled: Assembled, found: Sequence[Predicted], spreads: Sequence[Spread]
) -> Band:
    """The band in short, with the share of the measured samples that lie inside."""
    at = [s.counts for s in assembled.stretches]
    pieces = assembled.pieces
    parts = [Spread(s.parameters[m], s.noise) for s, m in zip(spreads, at, strict=True)]
    errors = [(f.force - p.force)[m] for f, p, m in zip(found, pieces, at, strict=True)]
    unseen = [shown_but_unseen(fit, model, p, f, parts[0].noise) for p, f in zip(pieces, found, strict=True)]
    return band(fit, parts, errors, [p.stroke.drive for p in pieces], set().union(*unseen))


def _ends(found: Sequence[Predicted], spreads: Sequence[Spread]) -> tuple[Array, Array]:
    ends = [limits(f.force, s) for f, s in zip(found, spreads, strict=True)]
    return np.concatenate([low for low, _ in ends]), np.concatenate([high for _, high in ends])


def _before(model: Model, assembled: Assembled, free_offset: bool) -> float | None:
    """RMSE [N] of a twin's baseline, the fit without effects; none of other models."""
    if model.baseline is None:
        return None
    plain = model_of_fit(model.baseline)
    errors = [
        (plain.on(p, free_offset=free_offset).force - p.force)[s.counts]
        for p, s in zip(assembled.pieces, assembled.stretches, strict=True)
    ]
    return rmse(np.concatenate(errors))


def _shrinkage(before: float, after: float, floor: float) -> float | None:
    """Part of the gap's variance that the effects take away; none within two per cent of the floor."""
    if before < _NEAR_FLOOR * floor:
        return None
    return 1.0 - (after**2 - floor**2) / (before**2 - floor**2)


def _held_out_in(fit: Fit) -> HoldOut:
    """What the fit kept out of itself, from its own settings."""
    patterns = fit.provenance.settings.get("hold_out")
    after = fit.provenance.settings.get("hold_out_after")
    return HoldOut(
        tuple(patterns.split(",")) if isinstance(patterns, str) else (),
        float(after) if after is not None else None,
    )

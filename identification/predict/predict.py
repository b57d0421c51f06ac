"""Prediction of a fit, twin or scenario on another log, compared with the recorded force."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version

import numpy as np

from identification.arrays import Array
from identification.documents import Band, Fit, ForceSeries, Prediction, Provenance
from identification.fitting import (
    DamperModel,
    Dataset,
    HoldOut,
    PiecePrediction,
    assemble,
    compute_drive_errors,
    compute_nrmse,
    compute_rmse,
    make_damper_model,
)
from identification.logs import Recording
from identification.predict.bands import (
    ForceUncertainty,
    compute_limits,
    estimate_force_uncertainty,
    estimate_record_noise,
    find_unobserved_active,
    make_band,
)

_NEAR_FLOOR = 1.02
"""Threshold on the RMSE over the noise floor [1]: below it, there is no gap that could shrink."""


@dataclass(frozen=True)
class _LogPrediction:
    """Simulated force of all stretches of a log."""

    dataset: Dataset
    pieces: Sequence[PiecePrediction]

    @property
    def errors(self) -> list[Array]:
        """Simulated less recorded force [N] at the valid samples of each stretch."""
        return [
            (prediction.force - piece.force)[stretch.valid_mask]
            for prediction, piece, stretch in zip(
                self.pieces, self.dataset.pieces, self.dataset.stretches, strict=True
            )
        ]

    @property
    def forces(self) -> list[Array]:
        """Recorded force [N] at the valid samples of each stretch."""
        return self.select_valid([p.force for p in self.dataset.pieces])

    @property
    def drives(self) -> list[Array]:
        """Drive [V or A] at the valid samples of each stretch."""
        return self.select_valid([p.excitation.drive for p in self.dataset.pieces])

    def select_valid(self, channels: Sequence[Array]) -> list[Array]:
        """Return the valid samples of a channel of each stretch."""
        return [c[s.valid_mask] for c, s in zip(channels, self.dataset.stretches, strict=True)]


def predict_log(
    fit: Fit | DamperModel, recording: Recording, *, free_offset: bool = False
) -> tuple[Prediction, ForceSeries]:
    """Simulate a fit, or the model in another document, on a log.

    Args:
        fit: fit with the delays of its bench, or a damper model.
        recording: the log; where the fit has read it, the samples that were held out then are held out here.
        free_offset: True to estimate a constant force of each stretch as well.

    Returns:
        Errors, and recorded and simulated force.
    """
    model = make_damper_model(fit) if isinstance(fit, Fit) else fit
    # Logs are compared by content, so a copied or renamed log is recognised.
    seen = isinstance(fit, Fit) and recording.sha256 in fit.provenance.logs.values()
    dataset = assemble([recording], _read_hold_out(fit) if seen and isinstance(fit, Fit) else HoldOut())
    log = _LogPrediction(dataset, [model.predict(p, free_offset=free_offset) for p in dataset.pieces])
    uncertainties = _estimate_uncertainties(fit, model, log) if isinstance(fit, Fit) else None
    band = _make_band(fit, model, log, uncertainties) if isinstance(fit, Fit) and uncertainties else None
    provenance = Provenance(
        logs={recording.path.name: recording.sha256},
        version=version("mrbench"),
        seed=fit.provenance.seed if isinstance(fit, Fit) else 0,
        settings={"free": "offset" if free_offset else None, "log_seen_by_fit": seen},
    )
    before = _compute_baseline_error(model, dataset, free_offset)
    return (
        _make_prediction(log, before, free_offset, band, provenance),
        _make_series(log, seen, _compute_limits(log, uncertainties) if uncertainties else None),
    )


def _make_prediction(
    log: _LogPrediction, before: float | None, free_offset: bool, band: Band | None, provenance: Provenance
) -> Prediction:
    errors, forces, floor = log.errors, log.forces, log.dataset.floor.noise
    error, force = np.concatenate(errors), np.concatenate(forces)
    rmse = compute_rmse(error)
    return Prediction(
        rmse_n=rmse,
        nrmse=compute_nrmse(error, force),
        bias_n=float(error.mean()),
        noise_floor_n=floor,
        per_drive=compute_drive_errors(log.drives, errors, forces, log.dataset.drive_unit),
        samples=len(error),
        freed=["y0 of each stretch"] + (["force offset of each stretch"] if free_offset else []),
        before_n=before,
        shrinkage=None if before is None else _compute_shrinkage(before, rmse, floor),
        band=band,
        provenance=provenance,
    )


def _make_series(log: _LogPrediction, seen: bool, limits: tuple[Array, Array] | None) -> ForceSeries:
    dataset = log.dataset
    held_out = dataset.held_out if seen else [np.ones(len(p.force), bool) for p in dataset.pieces]
    return ForceSeries(
        time=np.concatenate([s.time for s in dataset.stretches]),
        displacement=np.concatenate([p.excitation.displacement for p in dataset.pieces]),
        velocity=np.concatenate([p.excitation.velocity for p in dataset.pieces]),
        drive=np.concatenate([p.excitation.drive for p in dataset.pieces]),
        force=np.concatenate([p.force for p in dataset.pieces]),
        simulated=np.concatenate([p.force for p in log.pieces]),
        stretch=np.repeat(np.arange(len(log.pieces)), [len(p.force) for p in dataset.pieces]),
        held_out=np.concatenate(held_out),
        names=tuple(p.name for p in dataset.pieces),
        drive_unit=dataset.drive_unit,
        band=limits,
    )


def _estimate_uncertainties(fit: Fit, model: DamperModel, log: _LogPrediction) -> list[ForceUncertainty]:
    noise = estimate_record_noise(fit, log.dataset.floor.noise)
    return [
        estimate_force_uncertainty(fit, model, piece, prediction, noise)
        for piece, prediction in zip(log.dataset.pieces, log.pieces, strict=True)
    ]


def _make_band(
    fit: Fit, model: DamperModel, log: _LogPrediction, uncertainties: Sequence[ForceUncertainty]
) -> Band:
    """Summarise the band, with its coverage of the valid samples."""
    pieces = log.dataset.pieces
    parameters = log.select_valid([u.parameters for u in uncertainties])
    at_valid = [ForceUncertainty(p, u.noise) for p, u in zip(parameters, uncertainties, strict=True)]
    unobserved = [
        find_unobserved_active(fit, model, piece, prediction, at_valid[0].noise)
        for piece, prediction in zip(pieces, log.pieces, strict=True)
    ]
    drives = [p.excitation.drive for p in pieces]
    return make_band(fit, at_valid, log.errors, drives, set().union(*unobserved))


def _compute_limits(log: _LogPrediction, uncertainties: Sequence[ForceUncertainty]) -> tuple[Array, Array]:
    limits = [compute_limits(p.force, u) for p, u in zip(log.pieces, uncertainties, strict=True)]
    return np.concatenate([low for low, _ in limits]), np.concatenate([high for _, high in limits])


def _compute_baseline_error(model: DamperModel, dataset: Dataset, free_offset: bool) -> float | None:
    """Return the RMSE [N] of a twin's baseline, the fit without effects; None for other models."""
    if model.baseline is None:
        return None
    baseline = make_damper_model(model.baseline)
    log = _LogPrediction(dataset, [baseline.predict(p, free_offset=free_offset) for p in dataset.pieces])
    return compute_rmse(np.concatenate(log.errors))


def _compute_shrinkage(before: float, after: float, floor: float) -> float | None:
    """Return the part of the excess variance that the effects remove; None within two per cent of the floor."""
    if before < _NEAR_FLOOR * floor:
        return None
    return 1.0 - (after**2 - floor**2) / (before**2 - floor**2)


def _read_hold_out(fit: Fit) -> HoldOut:
    """Return the samples that the fit held out, from its settings."""
    patterns = fit.provenance.settings.get("hold_out")
    after = fit.provenance.settings.get("hold_out_after")
    return HoldOut(
        tuple(patterns.split(",")) if isinstance(patterns, str) else (),
        float(after) if after is not None else None,
    )

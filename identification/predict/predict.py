"""Prediction of a fit, twin or scenario on another log, compared with the recorded force."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version

import numpy as np

from identification.arrays import Array
from identification.documents import Band, Fit, ForceError, ForceSeries, Prediction, Provenance
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
    make_residual_band,
)
from identification.residual import ResidualForce

_NEAR_FLOOR = 1.02
"""Threshold on the RMSE over the noise floor [1]: below it, there is no gap that could shrink."""


@dataclass(frozen=True)
class _LogPrediction:
    """Simulated force of all stretches of a log."""

    dataset: Dataset
    pieces: Sequence[PiecePrediction]
    """Law and effects."""
    residuals: Sequence[ResidualForce] = ()
    """Learned residual of each stretch; empty where the model has none."""

    @property
    def simulated(self) -> list[Array]:
        """Simulated force (N,) [N] of each stretch, with the learned residual."""
        if not self.residuals:
            return [p.force for p in self.pieces]
        return [p.force + r.force for p, r in zip(self.pieces, self.residuals, strict=True)]

    @property
    def errors(self) -> list[Array]:
        """Simulated less recorded force [N] at the valid samples of each stretch."""
        return self._compare(self.simulated)

    @property
    def physics_errors(self) -> list[Array]:
        """The same without the learned residual."""
        return self._compare([p.force for p in self.pieces])

    @property
    def forces(self) -> list[Array]:
        """Recorded force [N] at the valid samples of each stretch."""
        return self.select_valid([p.force for p in self.dataset.pieces])

    @property
    def drives(self) -> list[Array]:
        """Drive [V or A] at the valid samples of each stretch."""
        return self.select_valid([p.excitation.drive for p in self.dataset.pieces])

    def _compare(self, forces: Sequence[Array]) -> list[Array]:
        pairs = zip(forces, self.dataset.pieces, strict=True)
        return self.select_valid([force - piece.force for force, piece in pairs])

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
    log = _simulate(model, dataset, free_offset)
    band, limits = _estimate_band(fit, model, log)
    provenance = Provenance(
        logs={recording.path.name: recording.sha256},
        version=version("mrbench"),
        seed=fit.provenance.seed if isinstance(fit, Fit) else 0,
        settings={"free": "offset" if free_offset else None, "log_seen_by_fit": seen},
    )
    before = _compute_baseline_error(model, dataset, free_offset)
    return (
        _make_prediction(log, before, free_offset, band, provenance),
        _make_series(log, seen, limits),
    )


def _simulate(model: DamperModel, dataset: Dataset, free_offset: bool) -> _LogPrediction:
    """Simulate law and effects, then the learned residual on the result."""
    pieces = [model.predict(p, free_offset=free_offset) for p in dataset.pieces]
    if model.residual is None:
        return _LogPrediction(dataset, pieces)
    pairs = zip(dataset.pieces, pieces, strict=True)
    return _LogPrediction(dataset, pieces, [model.residual.predict(p.excitation, s.force) for p, s in pairs])


def _estimate_band(
    fit: Fit | DamperModel, model: DamperModel, log: _LogPrediction
) -> tuple[Band | None, tuple[Array, Array] | None]:
    """Return the 95 % band and its limits (N,) [N]; None for a model without intervals."""
    if isinstance(fit, Fit):
        uncertainties = _estimate_uncertainties(fit, model, log)
        return _make_band(fit, model, log, uncertainties), _compute_limits(log, uncertainties)
    if model.residual is None:
        return None, None
    rest = model.residual.document.rest_n
    uncertainties = [ForceUncertainty(r.deviation, rest) for r in log.residuals]
    deviations = log.select_valid([r.deviation for r in log.residuals])
    return make_residual_band(deviations, rest, log.errors), _compute_limits(log, uncertainties)


def _make_prediction(
    log: _LogPrediction, before: float | None, free_offset: bool, band: Band | None, provenance: Provenance
) -> Prediction:
    errors, forces = log.errors, log.forces
    error, force = np.concatenate(errors), np.concatenate(forces)
    physics = np.concatenate(log.physics_errors)
    rmse, physics_rmse = compute_rmse(error), compute_rmse(physics)
    # Where late setpoints disturb every cycle, force that differs with the motion counts as noise. No model
    # predicts noise, so the error of a simulation of the recorded motion is an upper bound.
    floor = min(log.dataset.floor.noise, rmse, physics_rmse)
    return Prediction(
        rmse_n=rmse,
        nrmse=compute_nrmse(error, force),
        bias_n=float(error.mean()),
        noise_floor_n=floor,
        per_drive=compute_drive_errors(log.drives, errors, forces, log.dataset.drive_unit),
        samples=len(error),
        freed=["y0 of each stretch"] + (["force offset of each stretch"] if free_offset else []),
        before_n=before,
        shrinkage=None if before is None else _compute_shrinkage(before, physics_rmse, floor),
        physics=ForceError(rmse_n=physics_rmse, nrmse=compute_nrmse(physics, force)) if log.residuals else None,
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
        simulated=np.concatenate(log.simulated),
        stretch=np.repeat(np.arange(len(log.pieces)), [len(p.force) for p in dataset.pieces]),
        held_out=np.concatenate(held_out),
        names=tuple(p.name for p in dataset.pieces),
        drive_unit=dataset.drive_unit,
        band=limits,
        physics=np.concatenate([p.force for p in log.pieces]) if log.residuals else None,
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
    limits = [compute_limits(force, u) for force, u in zip(log.simulated, uncertainties, strict=True)]
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

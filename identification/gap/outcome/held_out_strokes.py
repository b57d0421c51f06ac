"""Error of the named set on strokes that the user held out, which no fit and no choice has read."""

from dataclasses import replace

import numpy as np

from identification.arrays import Array, BoolArray
from identification.documents import HeldOutError
from identification.fitting import Dataset, Problem
from identification.gap.fits import Candidate
from identification.residual import LearnedResidual
from identification.simulate import SENSITIVITY_COLUMNS

_Y0_STEPS = 4
"""Gauss-Newton steps for the inner displacement at the start of a stretch; the force is nearly linear in it."""


def measure_held_out_strokes(
    dataset: Dataset, problem: Problem, named: Candidate, residual: LearnedResidual | None = None
) -> HeldOutError | None:
    """Measure the error of a set on the held-out strokes of a dataset; None without any.

    A stretch without a fitted sample starts at the inner displacement that fits it best, as in a prediction.

    Args:
        dataset: recordings with the held-out samples.
        problem: problem of all pieces of the dataset.
        named: the named set; the law alone if none is named.
        residual: learned residual to be added to the simulated force.
    """
    masks = [h & s.valid_mask for h, s in zip(dataset.held_out, dataset.stretches, strict=True)]
    if not any(mask.any() for mask in masks):
        return None
    joint, unknowns = problem.replace_effects(named.fit.effects), named.fit.minimum.unknowns.copy()
    errors, forces = [], []
    for i, mask in enumerate(masks):
        if mask.any():
            simulated = _simulate_piece(joint, unknowns, i, mask)
            if residual is not None:
                simulated = simulated + residual.predict(joint.pieces[i].excitation, simulated).force
            errors.append((simulated - dataset.pieces[i].force)[mask])
            forces.append(dataset.pieces[i].force[mask])
    rmse = float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))
    return HeldOutError(rmse_n=rmse, nrmse=rmse / float(np.std(np.concatenate(forces))))


def _simulate_piece(problem: Problem, unknowns: Array, piece: int, mask: BoolArray) -> Array:
    """Return the simulated force (N,) [N] of a piece; ``mask`` (N,) are its held-out samples."""
    p = problem.get_piece(unknowns, piece)
    model = problem.make_model(unknowns, piece)
    if not p.train.any():
        column = SENSITIVITY_COLUMNS.index("y0")
        for _ in range(_Y0_STEPS):
            force, sensitivities = p.simulate(model, sensitivities=True)
            slope, error = sensitivities[mask, column], force[mask] - p.force[mask]
            model = replace(model, y0=model.y0 - float(slope @ error) / max(float(slope @ slope), 1e-300))
    return p.simulate(model)[0]

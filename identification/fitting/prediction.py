"""Prediction: simulation of a piece with y(0), and on request a force offset, fitted to it.

The inner displacement y(0) is not a property of the damper but of its motion before the stretch, and it decays
within seconds.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.damper import Coordinates
from identification.documents import DriveError
from identification.fitting.piece import Piece
from identification.signals import bin_drive
from identification.simulate import SENSITIVITY_COLUMNS, ActiveEffect, SimulationModel

_Y0 = SENSITIVITY_COLUMNS.index("y0")
_ITERATIONS = 2
"""Number of Gauss-Newton steps; the force is nearly linear in y(0)."""


@dataclass(frozen=True)
class PiecePrediction:
    """Simulated force of one piece."""

    force: Array
    """(N,) simulated force, offset included [N]."""
    y0: float
    """Inner displacement at the first sample [m]."""
    offset: float
    """Offset added to the simulated force [N]; 0 unless it was fitted."""


def predict_piece(
    piece: Piece,
    coordinates: Coordinates,
    delays: tuple[float, float] = (0.0, 0.0),
    *,
    effects: tuple[ActiveEffect, ...] = (),
    free_offset: bool = False,
) -> PiecePrediction:
    """Simulate a piece with y(0), and on request a force offset, fitted to it by Gauss-Newton.

    Args:
        piece: y(0) is fitted to its fitted samples, or to all if there are none.
        coordinates: the damper.
        delays: residual delays of force and drive channel [s].
        effects: active effects.
        free_offset: also fit a constant force.
    """
    y0, offset = float(piece.excitation.displacement.mean()), 0.0
    # y(0) decays over seconds, so filter and backlash within a sample do not affect it.
    fast = piece.make_fast()
    # A piece that is held out completely still needs its y(0).
    weight = piece.train if piece.train.any() else np.ones(len(piece.force))
    for _ in range(_ITERATIONS):
        model = make_piece_model(piece, coordinates, delays, y0, effects)
        force, sensitivities = fast.simulate(model, sensitivities=True)
        J = np.column_stack([sensitivities[:, _Y0]] + ([np.ones(len(force))] if free_offset else []))
        step = np.linalg.lstsq(J * weight[:, None], (piece.force - force - offset) * weight, rcond=None)[0]
        y0 += float(step[0])
        offset += float(step[1]) if free_offset else 0.0
    force, _ = piece.simulate(make_piece_model(piece, coordinates, delays, y0, effects))
    return PiecePrediction(force + offset, y0, offset)


def make_piece_model(
    piece: Piece,
    coordinates: Coordinates,
    delays: tuple[float, float],
    y0: float,
    effects: tuple[ActiveEffect, ...],
) -> SimulationModel:
    """Return the simulation model of a piece; the residual delays [s] are added to its known ones."""
    return SimulationModel(coordinates, y0, piece.force_delay + delays[0], piece.drive_delay + delays[1], effects)


def compute_rmse(error: Array) -> float:
    """Return the root mean square [N] of force errors (N,)."""
    return float(np.sqrt(np.mean(error**2))) if len(error) else float("nan")


def compute_nrmse(error: Array, force: Array) -> float:
    """Return the RMSE over the standard deviation of the recorded force, from arrays (N,) [N]."""
    return compute_rmse(error) / max(float(force.std()), 1e-12)


def compute_drive_errors(
    drives: Sequence[Array], errors: Sequence[Array], forces: Sequence[Array], unit: str
) -> list[DriveError]:
    """Return the force error at each drive over several stretches, with arrays (N,) each."""
    drive, error, force = np.concatenate(drives), np.concatenate(errors), np.concatenate(forces)
    return [
        DriveError(
            drive=round(value, 6),
            unit=unit,
            rmse_n=compute_rmse(error[samples]),
            nrmse=compute_nrmse(error[samples], force[samples]),
            samples=len(samples),
        )
        for value, samples in bin_drive(drive)
    ]

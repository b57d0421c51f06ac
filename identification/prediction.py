"""A model on recordings that it never saw: only the inner displacement at the start of each stretch is freed.

The inner displacement y(0) is no property of the damper but of what was done to it before, and it fades within
seconds; a force offset is freed only if asked for, and then it is said.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.damper.coordinates import Coordinates
from identification.drive import drive_bins
from identification.piece import Piece
from identification.results import DriveError
from identification.simulate import UNKNOWNS, ActiveEffect, Setting

_Y0 = UNKNOWNS.index("y0")
_ROUNDS = 2
"""Of Gauss-Newton: the force is nearly linear in y(0)."""


@dataclass(frozen=True)
class Predicted:
    """One stretch, simulated."""

    force: Array
    """(N,) simulated force [N], offset included."""
    y0: float
    """[m]"""
    offset: float
    """[N] added to the simulated force; 0 unless it was freed."""


def predict_piece(
    piece: Piece,
    point: Coordinates,
    delays: tuple[float, float] = (0.0, 0.0),
    *,
    effects: tuple[ActiveEffect, ...] = (),
    free_offset: bool = False,
) -> Predicted:
    """Simulate one stretch with y(0), and on request a force offset, fitted to it by Gauss-Newton.

    Args:
        piece: the stretch; y(0) is found on its fitted samples, or on all where none is fitted.
        point: the damper.
        delays: residual lags of force and drive channel [s], beyond what the instruments report.
        effects: what acts beside the law.
        free_offset: also fit a constant force.
    """
    y0, offset = float(piece.stroke.displacement.mean()), 0.0
    # y(0) fades over seconds: filter and play within a sample have no say in it.
    quick = piece.quicker()
    # A stretch that is held out whole still needs its y(0).
    weight = piece.train if piece.train.any() else np.ones(len(piece.force))
    for _ in range(_ROUNDS):
        force, slopes = quick.recorded(piece_setting(piece, point, delays, y0, effects), slopes=True)
        J = np.column_stack([slopes[:, _Y0]] + ([np.ones(len(force))] if free_offset else []))
        step = np.linalg.lstsq(J * weight[:, None], (piece.force - force - offset) * weight, rcond=None)[0]
        y0 += float(step[0])
        offset += float(step[1]) if free_offset else 0.0
    force, _ = piece.recorded(piece_setting(piece, point, delays, y0, effects))
    return Predicted(force + offset, y0, offset)


def piece_setting(
    piece: Piece, point: Coordinates, delays: tuple[float, float], y0: float, effects: tuple[ActiveEffect, ...]
) -> Setting:
    """What a stretch is simulated with: the delays [s] come on top of those that its instruments report."""
    return Setting(point, y0, piece.force_delay + delays[0], piece.drive_delay + delays[1], effects)


def rmse(error: Array) -> float:
    """Root mean square [N] of force errors (N,)."""
    return float(np.sqrt(np.mean(error**2))) if len(error) else float("nan")


def normalised(error: Array, force: Array) -> float:
    """RMSE over the standard deviation of the recorded force, both (N,) [N]."""
    return rmse(error) / max(float(force.std()), 1e-12)


def per_drive(
    drives: Sequence[Array], errors: Sequence[Array], forces: Sequence[Array], unit: str
) -> list[DriveError]:
    """Force error by drive over several stretches, each (N,)."""
    drive, error, force = np.concatenate(drives), np.concatenate(errors), np.concatenate(forces)
    return [
        DriveError(
            drive=round(value, 6),
            unit=unit,
            rmse_n=rmse(error[at]),
            nrmse=normalised(error[at], force[at]),
            samples=len(at),
        )
        for value, at in drive_bins(drive)
    ]

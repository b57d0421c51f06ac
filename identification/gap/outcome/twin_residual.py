"""Learned residual of a twin: the residual of law and effects, with conditions that are left out in turn."""

import numpy as np
import numpy.typing as npt

from identification.arrays import Array
from identification.documents import TwinResidual
from identification.fitting import measure_scales
from identification.gap.data import Cycles, EvaluationData, split_by_piece
from identification.gap.fits import Candidate
from identification.residual import ResidualSamples, StateUnits, learn_residual

Indices = npt.NDArray[np.intp]

_MIN_CONDITIONS = 3
"""Smallest number of strokes, or of drives, to leave out in turn; with fewer, parts of the time are left out."""
_TIME_PARTS = 5
"""Number of parts of the recording's time."""


def learn_twin_residual(evaluation: EvaluationData, named: Candidate, seed: int) -> TwinResidual | None:
    """Learn the residual of a set; None where none predicts conditions that were left out.

    Strokes that the user held out are not read.

    Args:
        evaluation: the recordings.
        named: the set whose residual is learned; the law alone if none is named.
        seed: seed of the choice of the support points.
    """
    pieces = evaluation.pieces
    residual = named.residual
    parts = (residual.simulated_force, residual.values, evaluation.usable, number_conditions(evaluation))
    split = zip(*(split_by_piece(values, pieces) for values in parts), strict=True)
    samples = [ResidualSamples(p.excitation, *values) for p, values in zip(pieces, split, strict=True)]
    return learn_residual(samples, _measure_units(evaluation), seed)


def number_conditions(evaluation: EvaluationData) -> Indices:
    """Return the number (N,) of each sample's condition: its stroke, else its drive, else a part of the time.

    Equal strokes with other drives count as one condition, because a damper's residual depends more on the stroke.
    """
    cycles = evaluation.cycles
    for keys in (_list_strokes(cycles), _list_drives(cycles)):
        used = np.unique(np.array(keys)[cycles.segment])
        if len(used) >= _MIN_CONDITIONS and "" not in used:
            numbers = {key: i for i, key in enumerate(sorted(set(keys)))}
            by_segment = np.array([numbers[key] for key in keys])
            return np.asarray(by_segment[cycles.segment][cycles.cycle])
    count = np.cumsum(evaluation.usable)
    return np.asarray((count - 1) * _TIME_PARTS // max(int(count[-1]), 1), np.intp)


def _list_strokes(cycles: Cycles) -> list[str]:
    """Return amplitude and frequency of each segment as text; empty where its motion is not periodic."""
    return [f"{c.amplitude:.2g} {c.frequency:.2g}" if c.frequency else "" for c in cycles.conditions]


def _list_drives(cycles: Cycles) -> list[str]:
    """Return the drive of each segment as text; empty where its motion is not periodic."""
    return [f"{c.drive:.3g}" if c.frequency else "" for c in cycles.conditions]


def _measure_units(evaluation: EvaluationData) -> StateUnits:
    """Measure the units in which the state is expressed."""
    pieces = evaluation.pieces
    scales = measure_scales(pieces)

    def select(channel: list[Array]) -> Array:
        return np.concatenate(channel)[evaluation.usable]

    drive = select([p.excitation.sampled_drive for p in pieces])
    displacement = select([p.excitation.displacement for p in pieces])
    lowest, highest = float(drive.min()), float(drive.max())
    return StateUnits(
        force=scales.force,
        length=scales.length,
        centre=float(displacement.min() + displacement.max()) / 2.0,
        velocity=scales.velocity,
        lowest_drive=lowest,
        highest_drive=highest if highest > lowest else lowest + 1.0,
    )

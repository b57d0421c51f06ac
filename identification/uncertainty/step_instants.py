"""Instants of drive steps between two samples.

A sampled drive shows after which sample it stepped, not the instant. The field follows within some samples, so
half a sample can change the force after a step by more than its noise. The instants are estimated from the force,
as the motion is from the displacement: by one Gauss-Newton step, with the prior of an instant anywhere in its
sample. One simulation with all steps earlier gives the sensitivities: the effect of a step ends before the next.

A shift that all steps have in common is a delay of the drive, which a fit or an effect determines. Only the
differences between steps are read from the force. Where they are no larger than by chance, as in a recording that
is sampled when it steps, the drive stays as recorded. An error of the model is treated as coloured noise.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from identification.arrays import Array, BoolArray
from identification.fitting import Piece, Problem
from identification.noise import (
    ScaleVariance,
    WhiteningFilter,
    design_whitening_filter,
    list_scales,
    measure_scale_variance,
)
from identification.signals import StepShifts, find_level_changes

_MEAN, _VARIANCE = 0.5, 1.0 / 12.0
"""Mean [samples] and variance [samples²] of an instant that may be anywhere in a sample."""
_TRIAL = 0.5
"""Shift of all steps from which the sensitivities are computed [samples]."""
_DEVIATIONS = 3.0
"""Standard deviations above chance from which the shifts of a recording are taken for real."""


class _Projections(NamedTuple):
    """Products of the sensitivities to the steps of a piece, (K,) each, in units of the noise."""

    information: Array
    """With themselves [1/samples²]."""
    gradient: Array
    """With the residual [1/samples]."""


def estimate_step_shifts(problem: Problem, unknowns: Array) -> tuple[StepShifts, ...] | None:
    """Estimate the shift of every step from the residual of a fit to drives as recorded.

    Returns:
        The shifts for each piece; None if chance explains them.
    """
    places = [find_level_changes(p.excitation.sampled_drive) for p in problem.pieces]
    if sum(map(len, places)) < 2:
        return None
    trials = [StepShifts(at, np.full(len(at), _TRIAL)) for at in places]
    recorded, shifted = problem.simulate(unknowns), shift_steps(problem, trials).simulate(unknowns)
    found = [
        _project(piece, trial, piece.force - first, (second - first) / _TRIAL)
        for piece, trial, first, second in zip(problem.pieces, trials, recorded, shifted, strict=True)
    ]
    information, gradient = (np.concatenate([f[k] for f in found]) for k in range(2))
    mean = float(gradient.sum() / max(information.sum(), 1e-300))
    rest, weight = gradient - mean * information, information + 1.0 / _VARIANCE
    if not _exceeds_chance(rest, information, weight):
        return None
    advances = np.split(np.clip(_MEAN + rest / weight, 0.0, 1.0), np.cumsum([len(at) for at in places])[:-1])
    return tuple(StepShifts(at, advance) for at, advance in zip(places, advances, strict=True))


def shift_steps(problem: Problem, shifts: Sequence[StepShifts]) -> Problem:
    """Return the problem with the steps of recorded drives shifted, one ``StepShifts`` for each piece."""
    return replace(problem, pieces=tuple(map(_shift_piece, problem.pieces, shifts)))


def _shift_piece(piece: Piece, shifts: StepShifts) -> Piece:
    drive = shifts.apply(piece.excitation.drive)
    return replace(piece, excitation=replace(piece.excitation, drive=drive), step_shifts=shifts)


def _project(piece: Piece, steps: StepShifts, residual: Array, sensitivity: Array) -> _Projections:
    """Return the products of the sensitivity to each step, up to the next step, behind a whitening filter."""
    valid = piece.train > 0
    residual = np.where(valid, residual, 0.0)
    noise = _design_filter(residual, valid)
    if not noise.deviation > 0.0:
        # A recording of which no sample is fitted says nothing about its steps.
        nothing = np.zeros(len(steps.places))
        return _Projections(nothing, nothing)
    sensitivity, filtered = np.where(valid, sensitivity, 0.0), noise.apply(residual) / noise.deviation
    edges = [*steps.places, len(residual)]
    parts = [slice(start - 1, stop - 1) for start, stop in itertools.pairwise(edges)]
    columns = [noise.apply(sensitivity[part]) / noise.deviation for part in parts]
    return _Projections(
        np.array([column @ column for column in columns]),
        np.array([column @ filtered[part] for column, part in zip(columns, parts, strict=True)]),
    )


def _design_filter(residual: Array, valid: BoolArray) -> WhiteningFilter:
    """Return the filter that makes a residual white."""
    scales = []
    for samples in list_scales(len(residual)):
        variance, differences = measure_scale_variance(residual, valid, samples)
        if differences:
            scales.append(ScaleVariance.from_signal(samples, variance, differences))
    white = math.sqrt(2.0 * scales[0].variance) if scales else float(np.std(residual))
    return design_whitening_filter(scales, white)


def _exceeds_chance(gradient: Array, information: Array, weight: Array) -> bool:
    """Return True if the shifts reduce the squares by more than they would in noise alone."""
    shares = information / weight
    expected, deviation = float(shares.sum()), math.sqrt(2.0 * float(np.sum(shares**2)))
    return float(np.sum(gradient**2 / weight)) > expected + _DEVIATIONS * deviation

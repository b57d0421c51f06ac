"""Input of a fit: usable recordings, and the problem that the fit minimises."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array
from identification.fitting import (
    DELAY_LIMIT,
    Dataset,
    Piece,
    Problem,
    RecordingScales,
    SearchSpace,
    assemble,
    estimate_least_damping,
    measure_scales,
)
from identification.logs import Recording, Stretch
from identification.pipeline.fit_request import FitRequest
from identification.signals import clean_recordings

_MAX_GROWTH = 3.0
"""Largest exponent with which the inner displacement may diverge within a stretch [1]."""
_OVERSHOOT_FRACTION = 0.005
"""Fraction of the samples at each end of the drive's range that may be overshoots [1]."""


@dataclass(frozen=True)
class FitInput:
    """Usable recordings of one damper, ready to be fitted."""

    dataset: Dataset
    problem: Problem
    stretches: tuple[Stretch, ...]
    """Recordings of the problem's pieces."""
    notes: tuple[str, ...]
    """Parts of the recordings that are left out, as text for a person."""


def prepare_fit(recordings: Sequence[Recording], request: FitRequest) -> FitInput:
    """Check recordings of one damper and make the problem that a fit of them minimises.

    Raises:
        UnusableDataError: too few usable samples are left to fit.
    """
    cleaned, notes = clean_recordings(recordings)
    dataset = assemble(cleaned, request.hold_out)
    problem = replace(make_problem(dataset, request.delay_prior), per_log=request.per_log)
    stretches = [s for s, p in zip(dataset.stretches, dataset.pieces, strict=True) if p.train.any()]
    return FitInput(dataset, problem, tuple(stretches), (*notes, *dataset.notes))


def make_problem(dataset: Dataset, delay_prior: float | None = None) -> Problem:
    """Return the problem that a fit of a dataset minimises.

    Args:
        dataset: the recordings.
        delay_prior: standard deviation of the channel delays beyond what the log reports [s], which then stay
            within three of it; None takes the log's clocks and leaves the delays unbounded.
    """
    # Held-out samples must not widen the range of drives in which a damper is sought.
    fitted = [p.excitation.drive[p.train > 0] for p in dataset.pieces]
    drives = np.concatenate(fitted)
    # A prior that the user states is binding. The one from the log's clocks may be exceeded where the data require
    # it.
    limit = np.inf if delay_prior is None else DELAY_LIMIT
    prior = dataset.delay_prior if delay_prior is None else delay_prior
    pieces = tuple(p for p in dataset.pieces if p.train.any())
    scales = measure_scales(pieces)
    space = SearchSpace(*_find_drive_range(drives), scales, lowest_k0=_find_lowest_k0(pieces, scales))
    # Delays are counted in deviations of their prior, so a prior of zero would leave them without a unit.
    return Problem(pieces, space, dataset.floor.noise, max(prior, 1e-9), delay_limit=limit)


def _find_lowest_k0(pieces: Sequence[Piece], scales: RecordingScales) -> float:
    """Return the stiffness [N/m] at which the inner displacement grows by e^3 in the longest stretch.

    Its time constant is (c0 + c1) / k0. A more negative k0 fits a drift and makes the simulation diverge.
    """
    longest = max(len(p.force) / p.excitation.rate for p in pieces)
    return -_MAX_GROWTH * estimate_least_damping(pieces, scales) / longest


def _find_drive_range(drives: Array) -> tuple[float, float]:
    """Return the lowest and highest drive at which the law must be physical, without short overshoots."""
    low, high = np.quantile(drives, [_OVERSHOOT_FRACTION, 1.0 - _OVERSHOOT_FRACTION])
    return float(low), float(high)

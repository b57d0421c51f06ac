"""Learning of a residual from the samples that law and effects were fitted to."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from identification.arrays import Array, BoolArray
from identification.documents import ResidualUnits, TwinResidual
from identification.residual.cross_validation import Choice, CrossValidation, Indices
from identification.residual.state import VARIABLES, StateUnits, compute_state
from identification.simulate import Excitation

_MAX_SAMPLES = 24_000
"""Approximate limit on the number of samples; more are thinned evenly."""
_SEARCH_SAMPLES = 6_000
"""Approximate number of samples from which variables and length scales are chosen; neighbours hardly differ."""
_SUPPORT_POINTS = 256
"""Number of support points."""
_USUAL_RATE = 0.5
"""Reciprocal length scale of a variable from which the search starts [1]."""
_FIRST_VARIABLES = 7
"""Number of variables with which the search starts; it may leave some out and add others."""
_MAX_ERROR = 0.98
"""Largest squared error on left-out conditions, over that without a residual, for which one is kept [1]."""
_MIN_CONDITIONS = 2
"""Smallest number of conditions; one condition cannot be predicted from the others."""


class ResidualSamples(NamedTuple):
    """One stretch of a recording from which a residual is learned; N samples."""

    excitation: Excitation
    law_force: Array
    """(N,) simulated force of law and effects [N]."""
    residual: Array
    """(N,) recorded less simulated force [N]."""
    used: BoolArray
    """(N,) True where a sample may be learned."""
    condition: npt.NDArray[np.intp]
    """(N,) number of the condition of each sample; equal numbers are left out together."""


def learn_residual(stretches: Sequence[ResidualSamples], units: StateUnits, seed: int) -> TwinResidual | None:
    """Learn a residual; None where none predicts conditions that were left out.

    Args:
        stretches: samples of all recordings.
        units: units of the state.
        seed: seed of the choice of the support points.
    """
    states, residual, condition = _select_samples(stretches, units)
    conditions = np.unique(condition)
    if len(conditions) < _MIN_CONDITIONS:
        return None
    validation = CrossValidation(states, residual, condition, states[_draw_support(condition, seed)])
    start = np.where(np.arange(len(VARIABLES)) < _FIRST_VARIABLES, _USUAL_RATE, 0.0)
    choice = validation.evaluate(validation.thin(_SEARCH_SAMPLES).choose(start).rates)
    if choice.error > _MAX_ERROR:
        return None
    return _make_document(validation, choice, units, len(conditions))


def _select_samples(
    stretches: Sequence[ResidualSamples], units: StateUnits
) -> tuple[Array, Array, npt.NDArray[np.intp]]:
    """Return states (N, D), residual (N,) and condition (N,) of evenly thinned samples."""
    tables = []
    for stretch in stretches:
        state = compute_state(stretch.excitation, stretch.law_force, units)
        tables.append(np.column_stack([state[name] for name in VARIABLES]))
    used = np.flatnonzero(np.concatenate([s.used for s in stretches]))
    used = used[:: max(1, math.ceil(len(used) / _MAX_SAMPLES))]
    return (
        np.concatenate(tables)[used],
        np.concatenate([s.residual for s in stretches])[used],
        np.concatenate([s.condition for s in stretches])[used],
    )


def _draw_support(condition: npt.NDArray[np.intp], seed: int) -> Indices:
    """Draw the support points, equally many of each condition; (M,) numbers of samples."""
    random = np.random.default_rng(seed)
    members = [np.flatnonzero(condition == c) for c in np.unique(condition)]
    each = max(_SUPPORT_POINTS // len(members), 1)
    return np.concatenate([random.choice(m, min(each, len(m)), replace=False) for m in members])


def _make_document(
    validation: CrossValidation, choice: Choice, units: StateUnits, conditions: int
) -> TwinResidual:
    kept = np.flatnonzero(choice.rates)
    basis, posterior = validation.fit(choice)
    prior, rest = validation.estimate_variances(choice)
    before = float(np.sqrt(np.mean(validation.residual**2)))
    return TwinResidual(
        units=ResidualUnits(**dict(zip(ResidualUnits.model_fields, units, strict=True))),
        rates={VARIABLES[i]: float(choice.rates[i]) for i in kept},
        points=basis.points[:, kept].tolist(),
        weights=posterior.weights.tolist(),
        factor=[posterior.factor[i, : i + 1].tolist() for i in range(len(posterior.factor))],
        ridge=choice.ridge,
        prior_n=math.sqrt(prior),
        rest_n=math.sqrt(rest),
        before_n=before,
        after_n=before * math.sqrt(max(choice.error, 0.0)),
        conditions=conditions,
    )

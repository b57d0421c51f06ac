"""Assessment of planned strokes: the smallest deviation of each coordinate, and the stroke to add."""

import numpy as np

from identification.arrays import Array, BoolArray
from identification.damper import COORDINATES
from identification.documents import DesignReport, ExpectedPrecision, PrecisionGain, StrokeProposal
from identification.experiment_design.assumed_damper import AssumedDamper
from identification.experiment_design.explanation import (
    describe_design,
    describe_precision,
    describe_proposal,
    explain_unidentifiable,
)
from identification.experiment_design.information import (
    compute_information,
    compute_relative_covariance,
    find_observable,
)
from identification.experiment_design.planned_strokes import OptionalStroke, PlannedStrokes, find_plan_limitations

IDENTIFIABLE = 0.5
"""Threshold on the relative deviation [1]: below it, a coordinate counts as identifiable."""
SUFFICIENT = 0.05
"""Threshold on the relative deviation [1]: below it, a coordinate is precise enough."""
_MIN_IMPROVEMENT = 1.3
"""Least factor [1] by which a proposed stroke improves a coordinate that is not precise enough."""


def assess_design(planned: PlannedStrokes, assumed: AssumedDamper) -> DesignReport:
    """Assess planned strokes and choose the best of the optional ones.

    Args:
        planned: strokes of a method, and strokes that could be added.
        assumed: damper and noise.
    """
    information = compute_information(assumed.coordinates, planned.excitation, assumed.noise)
    coordinates = _assess_coordinates(planned, assumed, information)
    proposal = _propose_stroke(planned, assumed, information)
    return DesignReport(
        method=planned.method,
        damper=assumed.name,
        noise_n=assumed.noise,
        drive_unit=planned.drive_unit,
        coordinates=coordinates,
        proposal=proposal,
        messages=describe_design(planned.method, assumed.name, assumed.noise, coordinates, proposal, SUFFICIENT),
    )


def _assess_coordinates(
    planned: PlannedStrokes, assumed: AssumedDamper, information: Array
) -> dict[str, ExpectedPrecision]:
    covariance, observable = compute_relative_covariance(information), find_observable(information)
    deviations = np.sqrt(np.diag(covariance))
    limitations = find_plan_limitations(planned.excitation)
    precisions = {}
    for i, quantity in enumerate(COORDINATES):
        relative = float(deviations[i]) if observable[i] else None
        identifiable = relative is not None and relative < IDENTIFIABLE
        reason = explain_unidentifiable(quantity, limitations, _find_most_correlated(covariance, i))
        precisions[quantity.symbol] = ExpectedPrecision(
            value=assumed.coordinates[i],
            unit=quantity.format_unit(planned.drive_unit),
            deviation_percent=None if relative is None or relative > 1.0 else _round_percent(100 * relative),
            identifiable=identifiable,
            note=describe_precision(quantity, relative) if identifiable and relative is not None else reason,
        )
    return precisions


def _find_most_correlated(covariance: Array, i: int) -> tuple[str, float]:
    """Return the other coordinate with the largest correlation to this one, and that correlation [1]."""
    sd = np.sqrt(np.diag(covariance))
    correlation = covariance[i] / (sd * sd[i])
    # The correlation with itself, which is one, does not count.
    correlation[i] = 0.0
    other = int(np.argmax(np.abs(correlation)))
    return COORDINATES[other].symbol, float(correlation[other])


def _propose_stroke(planned: PlannedStrokes, assumed: AssumedDamper, information: Array) -> StrokeProposal | None:
    """Return the optional stroke that improves the poor coordinates most; None if none improves one enough."""
    before = np.sqrt(np.diag(compute_relative_covariance(information)))
    poor = before > SUFFICIENT
    best: tuple[float, OptionalStroke, Array] | None = None
    for stroke in planned.optional_strokes if poor.any() else ():
        combined = information + compute_information(assumed.coordinates, stroke.excitation, assumed.noise)
        after = np.sqrt(np.diag(compute_relative_covariance(combined)))
        # Deviations below the sufficient one add no gain: a stroke must help the poor coordinates.
        gain = float(np.log(before[poor] / np.maximum(after[poor], SUFFICIENT)).sum())
        if best is None or gain > best[0]:
            best = (gain, stroke, after)
    if best is None or not (improved := poor & (before > _MIN_IMPROVEMENT * best[2])).any():
        return None
    return _make_proposal(best[1], before, best[2], improved, find_observable(information))


def _make_proposal(
    stroke: OptionalStroke, before: Array, after: Array, improved: BoolArray, observable: BoolArray
) -> StrokeProposal:
    gains = {
        q.symbol: PrecisionGain(
            before_percent=_round_percent(100 * before[i]) if observable[i] and before[i] <= 1.0 else None,
            after_percent=_round_percent(100 * after[i]),
        )
        for i, q in enumerate(COORDINATES)
        if improved[i]
    }
    return StrokeProposal(segment=stroke.segment, gains=gains, message=describe_proposal(stroke.segment, gains))


def _round_percent(percent: float) -> float:
    return float(f"{percent:.2g}")

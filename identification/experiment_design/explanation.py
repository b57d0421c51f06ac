"""Text of a design report, for a person who plans an experiment."""

from collections.abc import Mapping
from typing import Any

from identification.damper import Quantity
from identification.documents import ExpectedPrecision, PrecisionGain, StrokeProposal
from identification.experiment_design.planned_strokes import PlanLimitations

_DRIVE_DEPENDENT = {"F_b", "c0_b", "c1_b", "eta"}
_CONFOUNDED = 0.9
"""Threshold on the correlation of two coordinates [1]: above it, they cannot be distinguished."""


def describe_precision(quantity: Quantity, relative: float) -> str:
    """Return the note on a coordinate that the strokes identify with a relative deviation [1]."""
    return f"{quantity.meaning}: standard deviation {100 * relative:.2g} % at best"


def explain_unidentifiable(quantity: Quantity, limitations: PlanLimitations, correlated: tuple[str, float]) -> str:
    """Return the reason why the strokes do not identify a coordinate.

    ``correlated`` is the other coordinate with the largest correlation to this one, and that correlation [1].
    """
    name = f"{quantity.symbol} ({quantity.meaning})"
    # Before any correlation, because at one drive every slope is correlated with its base.
    if quantity.symbol in _DRIVE_DEPENDENT and limitations.has_one_drive:
        return f"{name} is not observable: the drive never changes"
    if quantity.symbol == "eta" and limitations.has_steps_only_at_rest:
        return f"{name} is not observable: the drive never changes during a stroke"
    other, correlation = correlated
    if abs(correlation) > _CONFOUNDED:
        return (
            f"{name} cannot be distinguished from {other}: in these strokes both change the force in the same way"
        )
    if quantity.symbol.startswith("c1") and limitations.has_one_velocity:
        return f"{name} hardly affects the force: all strokes have about the same speed, and it acts in slow ones"
    return f"{name} hardly affects the force of these strokes"


def describe_design(
    method: str,
    damper: str,
    noise: float,
    coordinates: Mapping[str, ExpectedPrecision],
    proposal: StrokeProposal | None,
    sufficient: float,
) -> list[str]:
    """Return the whole report as lines of text; ``sufficient`` is the relative deviation [1] that is enough."""
    precisions = [
        f"{name} {e.deviation_percent:g} %"
        for name, e in coordinates.items()
        if e.identifiable and e.deviation_percent is not None
    ]
    lines = [
        f"smallest standard deviations with {method}, for the damper {damper} and {noise:g} N of force noise: "
        + (", ".join(precisions) or "no coordinate is identifiable")
    ]
    lines += [e.note for e in coordinates.values() if not e.identifiable]
    if proposal is not None:
        return [*lines, proposal.message]
    poor = any(e.deviation_percent is None or e.deviation_percent > 100 * sufficient for e in coordinates.values())
    if poor:
        return [*lines, "no further stroke within the method's limits would improve these much"]
    return [*lines, "every coordinate is precise enough: no further stroke is needed"]


def describe_proposal(segment: Mapping[str, Any], gains: Mapping[str, PrecisionGain]) -> str:
    """Return the stroke to add and the coordinates that it improves."""
    changes = [f"{name} {_describe_before(gain)} to {gain.after_percent:g} %" for name, gain in gains.items()]
    return f"add {describe_segment(segment)}: {', '.join(changes)}"


def _describe_before(gain: PrecisionGain) -> str:
    return "from not observable" if gain.before_percent is None else f"from {gain.before_percent:g} %"


def describe_segment(segment: Mapping[str, Any]) -> str:
    """Return a short description of a method's segment: amplitude, frequency, duration and drive."""
    motion, drive = segment["motion"], segment["drive"]
    seconds = segment.get("duration_s")
    size = f"{1e3 * motion['amplitude_m']:g} mm at {motion['frequency_hz']:g} Hz"
    length = f", {seconds:g} s" if seconds else ""
    return f"a {motion['kind']} of {size}{length}, {_describe_drive(drive)}"


def _describe_drive(drive: Mapping[str, Any]) -> str:
    match drive["kind"]:
        case "constant":
            return f"at the constant drive {drive['value']:g}"
        case "staircase":
            return f"through the drives {', '.join(f'{level:g}' for level in drive['levels'])}"
        case "steps":
            low, high = min(drive["values"]), max(drive["values"])
            return f"with {len(drive['values'])} drive steps between {low:g} and {high:g} during the strokes"
        case other:
            return f"with a drive of kind {other}"

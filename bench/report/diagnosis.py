"""Diagnosis in a report: its document as far as the report needs it, and the text of its section."""

import shlex
from pathlib import Path
from typing import Any, Literal, NamedTuple

from pydantic import AliasChoices, Field

from bench.report.discovery import Discovery, make_discovery_context
from bench.report.documents import DocumentPart, ForceError, ParameterValue, read_document
from bench.report.values import (
    format_force,
    format_name,
    format_percent,
    format_quantity,
    format_share,
    format_significant,
)

PropertyRows = list[tuple[str, str]]

VERDICTS = {
    "no_gap": "The simulation reproduces the recording: no effect is missing.",
    "explained": "The simulation lacks effects, which the diagnosis names.",
    "partly_explained": "The simulation lacks effects, and the diagnosis names some of them.",
    "unexplained": "The simulation lacks an effect that no known effect explains.",
}
"""Sentence for each verdict."""
_DOCUMENTS = ("--out", "diagnosis.json", "--twin", "twin.json")
"""Options of a proposed command that name its documents."""


class Effect(DocumentPart):
    """A named effect."""

    name: str
    stage: str
    form: str
    parameters: dict[str, ParameterValue]
    share: float = Field(description="part of the gap that returns without this effect")
    share_ci95: tuple[float, float] | None = None
    probability: float
    note: str = ""


class EffectSet(DocumentPart):
    """Alternative set of effects that the recording does not rule out."""

    effects: list[str]
    probability: float


class HeldOutError(DocumentPart):
    """Force error on the strokes that the user held out."""

    rmse_n: float
    nrmse: float
    with_residual: ForceError | None = None


class Gap(DocumentPart):
    """Force errors on strokes that no fit used."""

    before_n: float
    after_n: float
    explainable_n: float | None = None
    noise_floor_n: float
    noise_floor_ci95: tuple[float, float] | None = None
    shrinkage: float | None = None
    shrinkage_ci95: tuple[float, float] | None = None
    nominal_n: float | None = None
    held_out: HeldOutError | None = None


class MapPoint(DocumentPart):
    """The gap in one condition."""

    drive: float
    amplitude_m: float
    frequency_hz: float
    phase: float
    gap_n: float


class GapLocation(DocumentPart):
    """Stage and conditions of the gap."""

    stage: str | None
    stages: dict[str, float]
    map: list[MapPoint]
    explainable: float


class Remainder(DocumentPart):
    """Part of the gap that the named effects leave."""

    gap_n: float
    explainable: float
    not_repeating: float | None = None
    stage: str | None = None
    variables: tuple[str, ...] = ()


class NextStroke(DocumentPart):
    """Proposed stroke that separates sets of effects."""

    segment: dict[str, Any]
    separates: list[list[str]]


class CrossCheck(DocumentPart):
    """The network's independent estimate of the named effects."""

    message: str = Field(validation_alias=AliasChoices("message", "said"))


class Provenance(DocumentPart):
    """Recordings that a diagnosis was made from."""

    logs: dict[str, str]


class Diagnosis(DocumentPart):
    """Part of a diagnosis that a report shows."""

    schema_: Literal["mrbench.diagnosis/1"] = Field(alias="schema")
    verdict: Literal["no_gap", "explained", "partly_explained", "unexplained"]
    effects: list[Effect]
    alternatives: list[EffectSet]
    probability: float
    unknown_probability: float
    gap: Gap
    where: GapLocation
    remainder: Remainder | None = None
    discovery: Discovery | None = None
    next_stroke: NextStroke | None = None
    explanation: str
    cross_check: CrossCheck | None = Field(default=None, validation_alias=AliasChoices("cross_check", "witness"))
    notes: tuple[str, ...] = ()
    provenance: Provenance | None = None


class EffectRow(NamedTuple):
    """Row of the table of effects."""

    name: str
    stage: str
    values: list[str]
    share: str
    probability: str
    note: str


def read_diagnosis(path: Path) -> Diagnosis:
    """Read a diagnosis from its file.

    Raises:
        ReportError: the file cannot be read or is not a diagnosis.
    """
    return read_document(path, Diagnosis, "a diagnosis written by `mrbench diagnose`")


def join_names(effects: list[str]) -> str:
    """Return the names of a set of effects as text."""
    return " and ".join(map(format_name, effects)) or "the law alone"


def make_context(diagnosis: Diagnosis, drive_unit: str) -> dict[str, Any]:
    """Return the values for the page's template; ``drive_unit`` is V or A."""
    return {
        "verdict": VERDICTS[diagnosis.verdict],
        "severity": "good" if diagnosis.verdict in ("no_gap", "explained") else "warning",
        "explanation": diagnosis.explanation,
        "gap": _make_gap_rows(diagnosis),
        "effects": [_make_effect_row(effect) for effect in diagnosis.effects],
        "sets": _make_set_rows(diagnosis),
        "discovery": _make_discovery_context(diagnosis),
        "search_command": _make_search_command(diagnosis),
        "next": _describe_next_stroke(diagnosis.next_stroke, drive_unit),
        "cross_check": diagnosis.cross_check.message if diagnosis.cross_check else "",
        "notes": diagnosis.notes,
    }


def _make_discovery_context(diagnosis: Diagnosis) -> dict[str, Any] | None:
    """Return the values for the cause outside the library; None if there is none."""
    if diagnosis.discovery is None:
        return None
    named = [effect.name for effect in diagnosis.effects]
    return make_discovery_context(diagnosis.discovery, diagnosis.gap.before_n, named)


def _make_search_command(diagnosis: Diagnosis) -> str:
    """Return the command that searches for a cause outside the library; empty with one, or without a gap."""
    if diagnosis.discovery is not None or diagnosis.verdict not in ("partly_explained", "unexplained"):
        return ""
    logs = list(diagnosis.provenance.logs) if diagnosis.provenance else ["LOG"]
    return shlex.join(["mrbench", "diagnose", *logs, "--discover", *_DOCUMENTS])


def _make_gap_rows(diagnosis: Diagnosis) -> PropertyRows:
    gap = diagnosis.gap
    rows: PropertyRows = [
        ("Noise floor of the force", f"{format_quantity(gap.noise_floor_n, gap.noise_floor_ci95, 'N')}"),
        ("Force error of the refitted law, on held-out strokes", format_force(gap.before_n)),
        ("Force error with the named effects", format_force(gap.after_n)),
    ]
    if gap.nominal_n is not None:
        rows.insert(1, ("Force error of the given simulation", format_force(gap.nominal_n)))
    if gap.shrinkage is not None and diagnosis.effects:
        rows.append(("Part of the gap that they close", format_share(gap.shrinkage, gap.shrinkage_ci95)))
    if gap.held_out is not None:
        errors = f"{format_force(gap.held_out.rmse_n)}, NRMSE {format_percent(gap.held_out.nrmse)}"
        rows.append(("Force error on the strokes of --hold-out, which no fit and no choice has read", errors))
        learned = gap.held_out.with_residual
        if learned is not None:
            errors = f"{format_force(learned.rmse_n)}, NRMSE {format_percent(learned.nrmse)}"
            rows.append(("The same with the learned residual, which names no cause", errors))
    if gap.explainable_n is not None and diagnosis.remainder is not None:
        rows.append(("Lowest force error that any model reached", format_force(gap.explainable_n)))
    return [*rows, *_make_remainder_rows(diagnosis.remainder)]


def _make_remainder_rows(remainder: Remainder | None) -> PropertyRows:
    """Make the rows of the part of the gap that is left; none where nothing is."""
    if remainder is None:
        return []
    rows: PropertyRows = [
        ("Remaining error beyond the noise", format_force(remainder.gap_n)),
        ("Part of it that follows stroke and drive", format_percent(remainder.explainable)),
    ]
    if remainder.not_repeating is not None:
        rows.append(("Part of it that differs from cycle to cycle", format_percent(remainder.not_repeating)))
    if remainder.variables:
        rows.append(("It depends on", ", ".join(map(format_name, remainder.variables))))
    if remainder.stage is not None:
        rows.append(("Its most probable stage", format_name(remainder.stage)))
    return rows


def _make_effect_row(effect: Effect) -> EffectRow:
    values = [
        f"{format_name(name)}: {format_quantity(parameter.value, parameter.ci95, parameter.unit)}"
        for name, parameter in effect.parameters.items()
    ]
    return EffectRow(
        format_name(effect.name),
        format_name(effect.stage),
        values,
        format_share(effect.share, effect.share_ci95),
        format_percent(effect.probability),
        effect.note,
    )


def _make_set_rows(diagnosis: Diagnosis) -> PropertyRows:
    """Make the rows of sets and probabilities: the named set, the alternatives, an unknown cause."""
    named = [(join_names([effect.name for effect in diagnosis.effects]), format_percent(diagnosis.probability))]
    alternatives = [(join_names(s.effects), format_percent(s.probability)) for s in diagnosis.alternatives]
    unknown = ("an effect outside the library", format_percent(diagnosis.unknown_probability))
    return [*(named if diagnosis.verdict != "unexplained" else []), *alternatives, unknown]


def _describe_next_stroke(stroke: NextStroke | None, drive_unit: str) -> str:
    """Describe the proposed stroke; empty if there is none."""
    if stroke is None:
        return ""
    motion, drive = stroke.segment.get("motion", {}), stroke.segment.get("drive", {})
    sizes = [
        f"{format_significant(1e3 * motion['amplitude_m'])} mm" if "amplitude_m" in motion else "",
        f"{format_significant(motion['frequency_hz'])} Hz" if "frequency_hz" in motion else "",
        f"{format_significant(drive['value'])} {drive_unit}" if "value" in drive else str(drive.get("kind", "")),
    ]
    sets = ", ".join(f"“{join_names(effects)}”" for effects in stroke.separates)
    return f"{motion.get('kind', 'stroke')} of {', '.join(filter(None, sizes))}: it separates {sets}."

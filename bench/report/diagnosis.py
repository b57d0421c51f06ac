"""What a report shows of a diagnosis: which effect is missing where, how far the gap shrinks, how sure that is."""

from pathlib import Path
from typing import Any, Literal, NamedTuple

from pydantic import Field

from bench.report.documents import Part, read_document
from bench.report.values import newton, percent, quantity, significant

Facts = list[tuple[str, str]]

VERDICTS = {
    "no_gap": "The simulation repeats the recording: nothing is missing.",
    "explained": "Something is missing in the simulation, and it is known what.",
    "partly_explained": "Part of what is missing in the simulation is known.",
    "unexplained": "Something is missing in the simulation that no known effect explains.",
}
"""The verdict in a sentence."""


class Value(Part):
    """One parameter of an effect."""

    value: float = Field(description="best value, in `unit`")
    unit: str = Field(description="SI unit")
    ci95: tuple[float, float] | None = Field(default=None, description="95 % interval, in `unit`")


class Effect(Part):
    """An effect that is held to be at work."""

    name: str
    stage: str
    form: str
    parameters: dict[str, Value]
    share: float = Field(description="part of the explained gap that is lost without it")
    probability: float
    note: str = ""


class EffectSet(Part):
    """Another set of effects that the recording does not rule out."""

    effects: list[str]
    probability: float


class Gap(Part):
    """How far simulation and recording are apart, on strokes that no fit saw."""

    before_n: float
    after_n: float
    noise_floor_n: float
    shrinkage: float | None = None
    shrinkage_ci95: tuple[float, float] | None = None
    nominal_n: float | None = None


class Place(Part):
    """The gap in one condition."""

    drive: float
    amplitude_m: float
    frequency_hz: float
    phase: float
    gap_n: float


class Where(Part):
    """Where the gap shows."""

    stage: str | None
    stages: dict[str, float]
    map: list[Place]
    explainable: float


class NextStroke(Part):
    """The stroke that would settle what is open."""

    segment: dict[str, Any]
    separates: list[list[str]]


class Witness(Part):
    """What the network says of the named effects."""

    said: str


class Diagnosis(Part):
    """A diagnosis, as far as a report shows it."""

    schema_: Literal["mrbench.diagnosis/1"] = Field(alias="schema")
    verdict: Literal["no_gap", "explained", "partly_explained", "unexplained"]
    effects: list[Effect]
    alternatives: list[EffectSet]
    probability: float
    unknown_probability: float
    gap: Gap
    where: Where
    next_stroke: NextStroke | None = None
    explanation: str
    witness: Witness | None = None
    notes: tuple[str, ...] = ()


class EffectRow(NamedTuple):
    """An effect in a table."""

    name: str
    stage: str
    values: list[str]
    share: str
    probability: str
    note: str


def read_diagnosis(path: Path) -> Diagnosis:
    """A diagnosis from its file.

    Raises:
        ReportError: there is no such file, or it is no diagnosis.
    """
    return read_document(path, Diagnosis, "a diagnosis made by `mrbench diagnose`")


def spelt(name: str) -> str:
    """A name of the library as words."""
    return name.replace("_", " ")


def together(effects: list[str]) -> str:
    """A set of effects in words."""
    return " and ".join(map(spelt, effects)) or "nothing beside the law"


def context(found: Diagnosis, drive_unit: str) -> dict[str, Any]:
    """What the page's template needs of a diagnosis; ``drive_unit`` is V or A."""
    return {
        "verdict": VERDICTS[found.verdict],
        "mood": "good" if found.verdict in ("no_gap", "explained") else "warning",
        "explanation": found.explanation,
        "gap": _gap_facts(found),
        "effects": [_effect_row(effect) for effect in found.effects],
        "sets": _set_rows(found),
        "next": _next_words(found.next_stroke, drive_unit),
        "witness": found.witness.said if found.witness else "",
        "notes": found.notes,
    }


def _gap_facts(found: Diagnosis) -> Facts:
    gap = found.gap
    facts = [
        ("Noise floor of the force", newton(gap.noise_floor_n)),
        ("Force error of the refitted law, strokes never seen", newton(gap.before_n)),
        ("The same with what is named", newton(gap.after_n)),
    ]
    if gap.nominal_n is not None:
        facts.insert(1, ("Force error of the given simulation", newton(gap.nominal_n)))
    if gap.shrinkage is not None and found.effects:
        interval = gap.shrinkage_ci95
        sure = f" ({percent(interval[0])} to {percent(interval[1])})" if interval else ""
        facts.append(("Part of the gap that this closes", f"{percent(gap.shrinkage)}{sure}"))
    return facts


def _effect_row(effect: Effect) -> EffectRow:
    values = [
        f"{spelt(name)}: {quantity(one.value, one.ci95, one.unit)}" for name, one in effect.parameters.items()
    ]
    return EffectRow(
        spelt(effect.name),
        spelt(effect.stage),
        values,
        percent(effect.share),
        percent(effect.probability),
        effect.note,
    )


def _set_rows(found: Diagnosis) -> list[tuple[str, str]]:
    """Each set with its probability, the named one first; something unknown last."""
    named = [(together([effect.name for effect in found.effects]), percent(found.probability))]
    others = [(together(one.effects), percent(one.probability)) for one in found.alternatives]
    unknown = ("something that the library does not have", percent(found.unknown_probability))
    return [*(named if found.verdict != "unexplained" else []), *others, unknown]


def _next_words(stroke: NextStroke | None, drive_unit: str) -> str:
    """The stroke that would settle the doubt, in words; empty where there is none."""
    if stroke is None:
        return ""
    motion, drive = stroke.segment.get("motion", {}), stroke.segment.get("drive", {})
    sizes = [
        f"{significant(1e3 * motion['amplitude_m'])} mm" if "amplitude_m" in motion else "",
        f"{significant(motion['frequency_hz'])} Hz" if "frequency_hz" in motion else "",
        f"{significant(drive['value'])} {drive_unit}" if "value" in drive else str(drive.get("kind", "")),
    ]
    apart = ", ".join(f"“{together(one)}”" for one in stroke.separates)
    return f"{motion.get('kind', 'stroke')} of {', '.join(filter(None, sizes))}: it tells apart {apart}."

"""Methods that a campaign runs: with a constant drive, for a warm-up, or with proposed strokes added."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from bench.campaigns.document.errors import CampaignDocumentError
from bench.campaigns.document.steps import RunSpec, Step, find_run
from bench.methods import Method
from bench.validation import describe_validation_error

WARM_UP_METHOD = "warm_up"
"""Name of the methods of warm-ups, whose runs are not identified."""
WARM_UP_BLOCK = 30.0
"""[s] Strokes between two comparisons of a warm-up with its temperature."""
Methods = Mapping[str, Method]
"""Methods of a campaign by name."""


def list_runs(steps: Iterable[Step]) -> list[RunSpec]:
    """Return the runs of all steps with a method of their own."""
    return [run for step in steps if (run := find_run(step)) is not None]


def get_method_name(run: RunSpec) -> str:
    """Return the name of a run's method."""
    if isinstance(run.method, str):
        return Path(run.method).stem
    return str(run.method.get("name", ""))


def make_run_method(methods: Methods, run: RunSpec) -> Method:
    """Return the method of a run, with the run's constant drive if it has one.

    Raises:
        CampaignDocumentError: the drive exceeds the limit of the method.
    """
    method = methods[get_method_name(run)]
    if run.drive is None:
        return method
    if run.drive > method.limits.drive:
        unit = method.drive_unit
        raise CampaignDocumentError(
            f"drive {run.drive:g} {unit} exceeds the limit of method {method.name}, {method.limits.drive:g} {unit}"
        )
    drive = {"kind": "constant", "value": run.drive}
    document = method.model_dump(mode="json", by_alias=True, exclude_defaults=True)
    segments = [{**segment, "drive": drive} for segment in document["segments"]]
    return _parse({**document, "segments": segments})


def make_warm_up(method: Method, cycles: int | None) -> Method:
    """Return the warm-up before a method: its first sine, for some cycles or one block.

    Raises:
        CampaignDocumentError: the method has no sine strokes.
    """
    document = method.model_dump(mode="json", by_alias=True, exclude_defaults=True)
    motion, drive = _find_sine(document)
    count = cycles or max(1, round(WARM_UP_BLOCK * motion["frequency_hz"]))
    segment = {"name": "warm_up", "motion": motion, "cycles": count, "drive": drive}
    kept = {key: document[key] for key in ("schema", "rate_hz", "drive_kind", "limits")}
    title = f"Warm-up before {method.name}"
    return _parse({**kept, "name": WARM_UP_METHOD, "title": title, "description": title, "segments": [segment]})


def _find_sine(document: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    warm_up = ((document.get("conditioning") or {}).get("before") or {}).get("warm_up")
    if warm_up is not None:
        return warm_up["motion"], {"kind": "constant", **warm_up["drive"]}
    for segment in document["segments"]:
        if segment["motion"]["kind"] == "sine":
            return segment["motion"], {"kind": "constant", "value": 0.0}
    raise CampaignDocumentError(
        f"method {document['name']} has no sine strokes to warm up with; give it a warm-up in its conditioning"
    )


def add_strokes(method: Method, strokes: Sequence[Mapping[str, Any]]) -> Method:
    """Return a method with proposed strokes added at its end, each under a new name.

    Raises:
        CampaignDocumentError: a stroke does not fit the method.
    """
    document = method.model_dump(mode="json", by_alias=True, exclude_defaults=True)
    added = [{**stroke, "name": f"next_stroke_{number}"} for number, stroke in enumerate(strokes, 1)]
    return _parse({**document, "segments": [*document["segments"], *added]})


def _parse(document: Mapping[str, Any]) -> Method:
    try:
        return Method.model_validate(document)
    except ValidationError as error:
        raise CampaignDocumentError(
            f"method {document['name']} cannot be changed: {describe_validation_error(error)}"
        ) from None

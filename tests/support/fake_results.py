"""Results and records of the fake service: routes of diagnosis, series, notes, tags, files and trash.

All documents are made by the models of service and identification, so that they cannot differ from them.
"""

import math
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from fastapi import APIRouter, Request, Response

from bench.comparison import StrokeError
from bench.jobs import DiagnosisSummary
from bench.service.routes.analyses.predictions import SimulatedSeries
from bench.service.routes.recordings.views import NotePage, NoteRequest, NoteView, RunChange, RunFile, RunFileList
from identification.documents import Diagnosis, NextStroke, Remainder
from tests.support.discovery_documents import make_discovery
from tests.support.fake_recording import SEGMENTS, make_columns

FORMER = Path(__file__).parents[1] / "contracts" / "documents_47f8566" / "diagnosis.json"
MADE = datetime(2025, 3, 4, 9, 20, tzinfo=UTC)
CHANGED = "run run-1 was changed meanwhile; read it again and repeat the change"
STROKE = {
    "name": "8mm_2Hz_0.25V",
    "motion": {"kind": "sine", "amplitude_m": 0.008, "frequency_hz": 2.0},
    "centre_m": 0.0,
    "fade_s": 0.5,
    "cycles": 12,
    "drive": {"kind": "constant", "value": 0.25},
}
"""Proposed stroke, a segment of a method."""
_RATE = 250
"""Samples of a series [1/s]."""


def make_diagnosis() -> Diagnosis:
    """Return a diagnosis with a named effect, an effect outside the library, a remainder and a next stroke."""
    former = Diagnosis.model_validate_json(FORMER.read_bytes())
    effect = former.effects[0].model_copy(update={"place": "parallel_force", "share_ci95": (0.91, 1.0)})
    left = [point.model_copy(update={"gap_n": 0.2 * point.gap_n}) for point in former.where.map]
    remainder = Remainder(
        gap_n=0.41, explainable=0.35, not_repeating=0.2, stage="mounting", map=left, variables=["acceleration"]
    )
    separated = [["gas_spring"], ["gas_spring", "fixture_compliance"]]
    changes = {
        "verdict": "partly_explained",
        "effects": [effect],
        "remainder": remainder,
        "discovery": _make_curved_discovery(),
        "next_stroke": NextStroke(segment=STROKE, separates=separated, expected_n=1.9, detectability=14.0),
    }
    # Validated again as a whole, because a copy is not.
    return Diagnosis.model_validate_json(former.model_copy(update=changes).model_dump_json(by_alias=True))


def _make_curved_discovery() -> Any:
    """Return an effect whose curve is a parabola over the displacement."""
    found = make_discovery()
    x = [0.001 * k for k in range(-12, 13)]
    value = [2e3 * one**2 for one in x]
    band = {"lo": [v - 0.03 for v in value], "hi": [v + 0.03 for v in value]}
    inertia = found.further[0]
    further = [inertia.model_copy(update={"curve": inertia.curve.model_copy(update={"unit": "N"})})]
    curve = found.curve.model_copy(update={"x": x, "value": value, **band})
    return found.model_copy(update={"curve": curve, "further": further})


def make_summary(identifier: str) -> dict[str, Any]:
    """Return the short answer of the diagnosis, as it stands in a run."""
    found = make_diagnosis()
    gap = {name: getattr(found.gap, name) for name in ("before_n", "after_n", "noise_floor_n", "shrinkage")}
    summary = DiagnosisSummary(
        id=identifier,
        verdict=found.verdict,
        effects=tuple(effect.name for effect in found.effects),
        probability=found.probability,
        shrinkage_ci95=found.gap.shrinkage_ci95,
        explanation=found.explanation,
        **gap,
    )
    return summary.model_dump(mode="json")


def make_series(start: float | None, stop: float | None, bias: float = 0.0) -> SimulatedSeries:
    """Return the force of the recording, or of a part of it [s], with a bias of the simulation [N]."""
    end = SEGMENTS[-1]["stop_s"]
    first, last = (0.0 if start is None else start), (end if stop is None else stop)
    time = np.arange(round(first * _RATE), round(last * _RATE) + 1) / _RATE
    displacement, velocity, force, drive = make_columns(time)
    simulated = force * 0.97 + 2e4 * displacement * np.abs(displacement) + bias
    columns = {"displacement": displacement, "velocity": velocity, "drive": drive, "force": force}
    band = {"simulated": simulated, "lower": simulated - 5.0, "upper": simulated + 5.0}
    return SimulatedSeries(
        run="run-1",
        drive_unit="V",
        samples=4 * len(time),
        decimated=True,
        time=time.tolist(),
        values={name: column.tolist() for name, column in (columns | band).items()},
        errors=tuple(_make_error(k, bias) for k in range(len(SEGMENTS))),
    )


def _make_error(number: int, bias: float) -> StrokeError:
    segment = SEGMENTS[number]
    return StrokeError(
        segment=segment["name"], start_s=segment["start_s"], stop_s=segment["stop_s"],
        amplitude_m=(0.005, 0.010)[number], frequency_hz=1.0, drive_value=(0.0, 0.2)[number],
        rmse_n=math.hypot((2.55, 4.1)[number], bias), bias_n=(-0.2, 0.6)[number] + bias, samples=8000,
        held_out=number == 1,
    )  # fmt: skip


def make_files(run_id: str) -> RunFileList:
    """Return the files of a run: log, fit, diagnosis, and exports that are made at their request."""
    log = RunFile(
        name=f"{run_id}.mcap", kind="log", path=f"/api/v1/runs/{run_id}/log", size=3_481_204, sha256="5f" * 32,
        media_type="application/octet-stream",
    )  # fmt: skip
    results = [
        RunFile(
            name=f"{kind}.json", kind=kind, path=f"/api/v1/{path}", media_type="application/json", size=41_730,
            sha256="a1" * 32, job=f"job-{run_id}", made=MADE,
        )
        for kind, path in (("fit", f"runs/{run_id}/fit"), ("diagnosis", f"runs/{run_id}/diagnosis"))
    ]  # fmt: skip
    export = RunFile(
        name="samples.csv", kind="export", path=f"/api/v1/runs/{run_id}/export?format=csv", media_type="text/csv"
    )
    return RunFileList(items=(log, *results, export))


class Records:
    """Notes, tags and trash of the runs of the fake service; another person changes the tags once in between."""

    def __init__(self, runs: dict[str, dict[str, Any]]) -> None:
        self.runs = runs
        self.revisions: dict[str, int] = {}
        self.interventions = 1
        self.notes = {
            "run-1": [NoteView(id=1, at=MADE, author="M. Curie", kind="note", text="Seal leaks a little.")]
        }

    def add_note(self, run_id: str, author: str, text: str, kind: Any = "note") -> NoteView:
        """Add a note to a run."""
        notes = self.notes.setdefault(run_id, [])
        notes.append(NoteView(id=len(notes) + 1, at=datetime.now(UTC), author=author, kind=kind, text=text))
        return notes[-1]

    def make_tag(self, run_id: str) -> str:
        """Return the `ETag` of a run."""
        return f'"{self.revisions.get(run_id, 0)}"'

    def change_tags(self, run_id: str, change: RunChange, tag: str | None) -> dict[str, Any] | None:
        """Change the tags of a run; None if the tag of its state is not that of the request."""
        if self.interventions:
            self.interventions -= 1
            self.revisions[run_id] = self.revisions.get(run_id, 0) + 1
        if tag != self.make_tag(run_id):
            return None
        self.revisions[run_id] = self.revisions.get(run_id, 0) + 1
        self.add_note(run_id, change.author, f"tags: {', '.join(change.tags) or 'none'}", "tags")
        self.runs[run_id]["tags"] = list(change.tags)
        return self.runs[run_id]


def analysis_routes() -> APIRouter:
    """Create the routes of diagnosis and series; every run has the same."""
    router = APIRouter()

    @router.get("/runs/{run_id}/diagnosis")
    async def diagnosis(run_id: str) -> Any:
        return make_diagnosis().model_dump(mode="json", by_alias=True)

    @router.get("/fits/{fit_id}/series")
    async def fit_series(fit_id: str, request: Request) -> Any:
        return make_series(*_read_span(request))

    @router.get("/predictions/{prediction_id}/series")
    async def prediction_series(prediction_id: str, request: Request) -> Any:
        return make_series(*_read_span(request), bias=3.0)

    return router


def _read_span(request: Request) -> tuple[float | None, float | None]:
    query = request.query_params
    first, last = (float(query[name]) if name in query else None for name in ("from", "to"))
    return first, last


def record_routes(records: Records, refuse: Any) -> APIRouter:
    """Create the routes of notes, tags, files and trash; ``refuse`` makes the answer to a refused request."""
    router = APIRouter(prefix="/runs/{run_id}")

    @router.get("/notes")
    async def notes(run_id: str) -> Any:
        return NotePage(items=tuple(records.notes.get(run_id, [])), next=None)

    @router.post("/notes", status_code=201)
    async def add(run_id: str, wanted: NoteRequest) -> Any:
        return records.add_note(run_id, wanted.author, wanted.text)

    @router.patch("")
    async def change(run_id: str, wanted: RunChange, request: Request, response: Response) -> Any:
        changed = records.change_tags(run_id, wanted, request.headers.get("if-match"))
        response.headers["ETag"] = records.make_tag(run_id)
        return changed or refuse(412, "Changed meanwhile", CHANGED)

    @router.get("/files")
    async def files(run_id: str) -> Any:
        return make_files(run_id)

    @router.delete("")
    async def trash(run_id: str) -> Any:
        records.runs[run_id]["trashed"] = MADE.isoformat()
        return records.runs[run_id]

    @router.post("/restore")
    async def restore(run_id: str) -> Any:
        records.runs[run_id]["trashed"] = None
        return records.runs[run_id]

    return router

"""Batches and changes between results of the fake service, made by the models of the product."""

import json
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from fastapi import APIRouter, Response
from fastapi.responses import JSONResponse

from bench.jobs import BatchRequest
from bench.results import Batch, BatchRow, compare_results, write_csv

FORMER = Path(__file__).parents[1] / "contracts" / "documents_47f8566"
OLDER_VERSION = "0.0.9"
REASON = "the worker was killed five times"
_NUMBERS = {"rmse_n": 1.31, "noise_floor_n": 1.26, "result": "converged"}
_ANSWER = {
    "verdict": "explained", "effects": ("gas_spring",), "probability": 0.97, "before_n": 5.4, "after_n": 2.51,
    "shrinkage": 0.98,
}  # fmt: skip
_NOTHING = {
    "result": "", "rmse_n": None, "noise_floor_n": None, "verdict": "", "effects": (), "probability": None,
    "before_n": None, "after_n": None, "shrinkage": None, "error": "",
}  # fmt: skip
_CREATED = datetime(2025, 3, 4, 10, 0, tzinfo=UTC)


class FakeBatches:
    """Batches: the first run is done when it is first asked for, the others at the second time; run-3 fails."""

    def __init__(self, runs: dict[str, dict[str, Any]]) -> None:
        self.runs = runs
        self.requests: dict[str, BatchRequest] = {}
        self.asked: dict[str, int] = {}

    def add(self, request: BatchRequest) -> Batch:
        """Add a batch."""
        identifier = f"batch-{len(self.requests) + 1}"
        self.requests[identifier] = request
        return self.show(identifier)

    def show(self, identifier: str) -> Batch:
        """Return a batch in its present state."""
        request = self.requests[identifier]
        are_done = self.asked.get(identifier, 0) > 1
        rows = tuple(
            self._make_row(run, request.kind, is_done=are_done or not k) for k, run in enumerate(request.runs)
        )
        unfinished = sum(row.state == "running" for row in rows)
        return Batch(
            id=identifier, kind=request.kind, settings={}, created=_CREATED, unfinished=unfinished, rows=rows
        )

    def _make_row(self, run: str, kind: str, *, is_done: bool) -> BatchRow:
        known = {name: self.runs[run][name] for name in ("specimen", "method", "started")}
        if not is_done:
            found: dict[str, Any] = {"state": "running"}
        elif run == "run-3":
            found = {"state": "failed", "error": REASON}
        else:
            found = {"state": "done", **(_ANSWER if kind == "diagnose" else _NUMBERS)}
        return BatchRow(**{**_NOTHING, **known, "run": run, "job": f"{kind}-{run}", **found})


def batch_routes(batches: FakeBatches) -> APIRouter:
    """Create the routes of batches and of the changes of each result."""
    router = APIRouter()

    @router.post("/batches", status_code=201)
    async def add(request: BatchRequest) -> Batch:
        return batches.add(request)

    @router.get("/batches/{batch_id}")
    async def show(batch_id: str) -> Any:
        if batch_id not in batches.requests:
            detail = f"there is no batch {batch_id}"
            return JSONResponse({"title": "Not found", "status": 404, "detail": detail}, status_code=404)
        batches.asked[batch_id] = batches.asked.get(batch_id, 0) + 1
        return batches.show(batch_id)

    @router.get("/batches/{batch_id}/table")
    async def save(batch_id: str) -> Any:
        return Response(write_csv(batches.show(batch_id)), media_type="text/csv")

    @router.get("/jobs/{job_id}/changes")
    async def compare(job_id: str) -> Any:
        name = "diagnosis" if job_id.startswith("diagnosis") else "fit"
        newer = json.loads((FORMER / f"{name}.json").read_bytes())
        return compare_results(make_older(newer), newer, (f"older-{job_id}", job_id))

    return router


def make_older(newer: dict[str, Any]) -> dict[str, Any]:
    """Return a result of the older version: another `k0` in a fit, another verdict and effect in a diagnosis."""
    older: dict[str, Any] = json.loads(json.dumps(newer))
    older["provenance"]["version"] = OLDER_VERSION
    if "verdict" in older:
        older["verdict"] = "partly_explained"
        older["effects"][0]["name"] = "seal_friction"
        return older
    parameter = older["parameters"]["k0"]
    parameter["value"] *= 2.0
    parameter["ci95"] = [2.0 * edge for edge in parameter["ci95"]]
    return older

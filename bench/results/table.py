"""Batch: the same job for several runs, with one table of their results."""

import csv
import io
from collections.abc import Mapping
from datetime import datetime
from typing import Any

from pydantic import Field

from bench import catalogue
from bench.catalogue import JobRow, RunRow
from bench.validation import FrozenModel


class BatchRow(FrozenModel):
    """Result on one run."""

    run: str = Field(description="id of the run")
    specimen: str
    method: str
    started: datetime | None = Field(description="UTC of the run; null for an unknown one")
    job: str = Field(description="id of the job; empty without one")
    state: str = Field(description="state of the job; `refused` without one")
    error: str = Field(description="reason of a failure or refusal")
    result: str = Field(description="of a fit: `converged`, or the reason why not")
    rmse_n: float | None = Field(description="force error of a fit on the fitted samples [N]")
    noise_floor_n: float | None = Field(description="noise floor of the recorded force [N]")
    verdict: str = Field(description="verdict of a diagnosis")
    effects: tuple[str, ...] = Field(description="effects that a diagnosis names")
    probability: float | None = Field(description="probability of exactly these effects")
    before_n: float | None = Field(description="force error of the law alone on held-out strokes [N]")
    after_n: float | None = Field(description="force error with the effects on held-out strokes [N]")
    shrinkage: float | None = Field(description="part of the gap that the effects close")


class Batch(FrozenModel):
    """One request of the same job for several runs."""

    id: str
    kind: str = Field(description="`identify` or `diagnose`")
    settings: dict[str, Any] = Field(description="requested settings")
    created: datetime = Field(description="UTC")
    unfinished: int = Field(description="number of jobs that are queued or running")
    rows: tuple[BatchRow, ...] = Field(description="one for each run, in the order of the request")


def make_batch_view(batch: catalogue.BatchRow, jobs: Mapping[str, JobRow], runs: Mapping[str, RunRow]) -> Batch:
    """Return a batch with its table.

    Args:
        batch: the batch.
        jobs: its jobs by id.
        runs: its runs by id.
    """
    rows = [_make_row(item, jobs.get(item.get("job", "")), runs.get(item["run"])) for item in batch.items]
    return Batch(
        id=batch.id,
        kind=batch.kind,
        settings=batch.settings,
        created=batch.created,
        unfinished=sum(row.state in catalogue.UNFINISHED_STATES for row in rows),
        rows=tuple(rows),
    )


def _make_row(item: Mapping[str, str], job: JobRow | None, run: RunRow | None) -> BatchRow:
    summary = (job.summary if job and job.state == "done" else None) or {}
    numbers = ("rmse_n", "noise_floor_n", "probability", "before_n", "after_n", "shrinkage")
    return BatchRow(
        run=item["run"],
        specimen=run.specimen if run else "",
        method=run.method if run else "",
        started=run.started if run else None,
        job=job.id if job else "",
        state=job.state if job else "refused",
        error=job.error if job else item.get("reason", ""),
        result=summary.get("result", ""),
        verdict=summary.get("verdict", ""),
        effects=tuple(summary.get("effects", ())),
        **{name: summary.get(name) for name in numbers},
    )


def write_csv(batch: Batch) -> str:
    """Return the table of a batch as CSV, its columns named as the fields; effects are separated by spaces."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(BatchRow.model_fields), lineterminator="\n")
    writer.writeheader()
    for row in batch.rows:
        values = row.model_dump(mode="json")
        writer.writerow(
            {name: _escape(value) for name, value in values.items()} | {"effects": " ".join(row.effects)}
        )
    return text.getvalue()


def _escape(value: object) -> object:
    """Return a value of a cell; a text that a spreadsheet would take for a formula begins with an apostrophe."""
    return f"'{value}" if isinstance(value, str) and value.startswith(("=", "+", "-", "@")) else value

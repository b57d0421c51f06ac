"""Identification and diagnosis in this process's own commands, for a campaign without service and worker.

The jobs are kept in the catalogue as those of a worker, so that a service on the same data folder shows them.
"""

import uuid
from datetime import UTC, datetime
from importlib.metadata import version
from typing import Any

from bench.catalogue import Catalogue, JobRow, RunRow
from bench.jobs import (
    FIT_FILE,
    DiagnoseSettings,
    IdentifySettings,
    JobCallbacks,
    JobError,
    JobSettings,
    JobSpec,
    compute_content_key,
    execute_job,
    get_kind,
    get_result_folder,
)

IDENTIFICATION = IdentifySettings(stages=("refine",))
"""Settings without the network, which needs most of the time and gives conditions nothing."""


def evaluate_run(catalogue: Catalogue, run: RunRow, *, diagnose: bool) -> None:
    """Identify a run, and diagnose it if asked; what is done already is not repeated."""
    fit = _run_job(catalogue, run, IDENTIFICATION, None)
    if diagnose and fit.state == "done":
        _run_job(catalogue, run, DiagnoseSettings(), fit)


def _run_job(catalogue: Catalogue, run: RunRow, settings: JobSettings, fit: JobRow | None) -> JobRow:
    log = catalogue.resolve_path(run.log)
    inputs = {} if fit is None else {"fit": fit}
    key = compute_content_key(run.log_sha256 or "", settings, [f"fit:{job.key}" for job in inputs.values()])
    wanted = _make_row(run, settings, key, {name: job.id for name, job in inputs.items()})
    job, is_queued = catalogue.job_queue.request(
        wanted, lambda done: done.result is not None and catalogue.resolve_path(done.result).is_dir()
    )
    if job.state == "done" and not is_queued:
        return job
    result = get_result_folder(log, job.kind, key)
    fit_file = "" if fit is None else str(catalogue.resolve_path(fit.result or "") / FIT_FILE)
    spec = JobSpec(job_id=job.id, key=key, log=str(log), result=str(result), settings=settings, fit=fit_file)
    try:
        summary = execute_job(spec, JobCallbacks(lambda progress: None, lambda: False))
    except JobError as error:
        values: dict[str, Any] = {"state": "failed", "error": str(error)}
    else:
        values = {"state": "done", "summary": summary, "result": catalogue.make_name(result), "fraction": 1.0}
    finished, _ = catalogue.job_queue.finish(job.id, None, finished=datetime.now(UTC), **values)
    return finished or job


def _make_row(run: RunRow, settings: JobSettings, key: str, inputs: dict[str, str]) -> JobRow:
    now = datetime.now(UTC)
    return JobRow(
        id=uuid.uuid4().hex,
        run_id=run.id,
        kind=get_kind(settings),
        key=key,
        settings=settings.model_dump(mode="json"),
        inputs=inputs,
        version=version("mrbench"),
        state="queued",
        created=now,
        queued=now,
        attempts=0,
    )

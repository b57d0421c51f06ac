"""Route that lists the files of a run."""

from collections.abc import Iterator
from pathlib import Path
from urllib.parse import quote

from fastapi import APIRouter

from bench.catalogue import JobFilter, JobRow, RunRow, compute_sha256
from bench.jobs import DIAGNOSIS_FILE, FIT_FILE, PREDICTION_FILE, TWIN_FILE
from bench.service.context import Context, ServiceContext
from bench.service.routes.exchange import list_offers
from bench.service.routes.recordings.views import RunFile, RunFileList

router = APIRouter(prefix="/runs", tags=["recordings"])
_MAX_JOBS = 200
_API = "/api/v1"
_RESULTS = {
    FIT_FILE: ("fit", "fits/{}", "application/json"),
    DIAGNOSIS_FILE: ("diagnosis", "diagnoses/{}", "application/json"),
    PREDICTION_FILE: ("prediction", "predictions/{}", "application/json"),
    TWIN_FILE: ("twin", "twins/{}", "application/json"),
}
"""Kind, path below the interface and media type of a result, by the name of its file."""


@router.get("/{run_id}/files")
def list_files(run_id: str, context: Context) -> RunFileList:
    """List the files of a run with sizes, hashes and addresses: log, results, exports and reports."""
    row = context.get_run(run_id)
    jobs = context.catalogue.job_queue.list_jobs(JobFilter(("done",), None, run_id), _MAX_JOBS)
    results = [file for job in jobs for file in _list_results(context, job)]
    return RunFileList(items=(*_list_log(context, row), *results, *_list_offers(row)))


def _list_offers(row: RunRow) -> Iterator[RunFile]:
    """Yield exports and reports, which are made at their request, of a run with a complete log."""
    if row.log_sha256 is not None:
        for name, kind, path, media_type in list_offers(row.id):
            yield RunFile(name=name, kind=kind, path=f"{_API}/{path}", media_type=media_type)


def _list_log(context: ServiceContext, row: RunRow) -> Iterator[RunFile]:
    path = context.catalogue.resolve_path(row.log)
    if path.is_file():
        address = f"runs/{quote(row.id, safe='')}/log"
        yield _make_file(path, "log", address, "application/octet-stream", row.log_sha256)


def _list_results(context: ServiceContext, job: JobRow) -> Iterator[RunFile]:
    folder = context.catalogue.resolve_path(job.result or "")
    for name, (kind, address, media_type) in _RESULTS.items():
        if job.result is not None and (folder / name).is_file():
            sha256 = compute_sha256(folder / name)
            yield _make_file(folder / name, kind, address.format(job.id), media_type, sha256, job)


def _make_file(
    path: Path, kind: str, address: str, media_type: str, sha256: str | None, job: JobRow | None = None
) -> RunFile:
    return RunFile(
        name=path.name,
        kind=kind,
        path=f"{_API}/{address}",
        media_type=media_type,
        size=path.stat().st_size,
        sha256=sha256,
        job=job.id if job else None,
        made=job.finished if job else None,
    )

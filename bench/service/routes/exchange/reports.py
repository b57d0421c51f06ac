"""Route that returns the report of a run, as page, PDF or workbook; also without a fit."""

import asyncio
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Query
from fastapi.responses import FileResponse

from bench.catalogue import JobRow, RunRow
from bench.errors import ReportError
from bench.jobs import DIAGNOSIS_FILE, FIT_FILE, REPORT_FILE
from bench.report.formats import REPORT_FORMATS, ReportFormat
from bench.service.context import Context, ServiceContext
from bench.service.files import SnapshotResponse
from bench.service.requests import NOT_MODIFIED
from bench.service.routes.exchange.offers import MEDIA_TYPES
from bench.service.routes.results import check_complete
from bench.service.transfer import run_command, send_temporary_file

router = APIRouter(prefix="/runs", tags=["results"])
_FILES: dict[int | str, dict[str, Any]] = {
    200: {"description": "the report", "content": {MEDIA_TYPES[one]: {} for one in REPORT_FORMATS}},
    **NOT_MODIFIED,
}
_DOCUMENTS = {"identify": ("--fit", FIT_FILE), "diagnose": ("--diagnosis", DIAGNOSIS_FILE)}
"""Option of the report and file of each kind of job."""


@router.get("/{run_id}/report", response_class=FileResponse, responses=_FILES)
async def get_newest_report(
    run_id: str,
    context: Context,
    report_format: Annotated[
        ReportFormat, Query(alias="format", description="page, PDF, or workbook with samples and derived values")
    ] = "html",
) -> FileResponse:
    """Return the report on a run with its newest fit and diagnosis; without a fit, on the recording alone.

    The page of a fit or diagnosis is stored with it. Any other report is made at the request, in some seconds.
    """
    row = await asyncio.to_thread(context.get_run, run_id)
    results = await asyncio.to_thread(_find_results, context, row)
    if report_format == "html" and results:
        stored = _find_page(context, max(results, key=_get_end))
        if stored is not None:
            return stored
    return await asyncio.to_thread(_make_report, context, row, results, report_format)


def write_report(context: ServiceContext, row: RunRow, report_format: ReportFormat, out: Path) -> None:
    """Write the present report on a run to a file with the ending of its format.

    Raises:
        ReportError: it cannot be made.
        ProblemError: the run has no complete log.
    """
    results = _find_results(context, row)
    if report_format == "html" and results:
        page = _locate_page(context, max(results, key=_get_end))
        if page.is_file():
            out.write_bytes(page.read_bytes())
            return
    check_complete(row, "reported on")
    _run_report(context, row, results, str(out))


def find_newest_result(context: ServiceContext, row: RunRow) -> datetime | None:
    """Return the UTC at which the newest fit or diagnosis of a run ended; None without one."""
    return max(map(_get_end, _find_results(context, row)), default=None)


def _get_end(job: JobRow) -> datetime:
    return job.finished or job.created


def _find_results(context: ServiceContext, row: RunRow) -> list[JobRow]:
    """Return the newest job of each kind with a result."""
    found = (context.catalogue.job_queue.find_newest_done(row.id, kind) for kind in _DOCUMENTS)
    return [job for job in found if job is not None]


def _find_page(context: ServiceContext, job: JobRow) -> SnapshotResponse | None:
    """Return the stored page of a job; None if it was removed."""
    path = _locate_page(context, job)
    try:
        return SnapshotResponse(path, MEDIA_TYPES["html"], f"{job.run_id}.{REPORT_FILE}", inline=True)
    except FileNotFoundError:
        return None


def _locate_page(context: ServiceContext, job: JobRow) -> Path:
    return context.catalogue.resolve_path(job.result or "") / REPORT_FILE


def _make_report(
    context: ServiceContext, row: RunRow, results: list[JobRow], report_format: ReportFormat
) -> FileResponse:
    check_complete(row, "reported on")

    def write(out: str) -> None:
        _run_report(context, row, results, out)

    name = f"{row.id}.report.{report_format}"
    inline = report_format != "xlsx"
    return send_temporary_file(context.data, name, MEDIA_TYPES[report_format], write, inline=inline)


def _run_report(context: ServiceContext, row: RunRow, results: list[JobRow], out: str) -> None:
    log = context.locate_log(row)
    run_command(["report", str(log), *_list_documents(context, results), "--out", out], ReportError)


def _list_documents(context: ServiceContext, results: list[JobRow]) -> Iterator[str]:
    """Yield the options that name the documents that still exist."""
    for job in results:
        option, name = _DOCUMENTS[job.kind]
        path = context.catalogue.resolve_path(job.result or "") / name
        if path.is_file():
            yield from (option, str(path))

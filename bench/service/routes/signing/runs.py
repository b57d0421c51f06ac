"""Routes that keep and sign the report on a run."""

from pathlib import Path

from fastapi import APIRouter
from fastapi.responses import FileResponse

from bench.service.context import Context
from bench.service.files import SnapshotResponse, describe_file
from bench.service.requests import IDEMPOTENT, IdempotentRoute, Sender
from bench.service.routes.exchange import MEDIA_TYPES, find_newest_result, write_report
from bench.service.routes.signing.answers import TOO_MANY, list_hashes, send_report
from bench.service.routes.signing.kept_reports import Subject, keep_report
from bench.service.routes.signing.signatures import list_signatures, make_copy_view, sign_report
from bench.service.routes.signing.views import (
    CopyRequest,
    CopyView,
    SignatureList,
    SignatureRequest,
    SignatureView,
)

router = APIRouter(prefix="/runs", tags=["results"], route_class=IdempotentRoute)
_FILES = describe_file(*(MEDIA_TYPES[one] for one in ("html", "pdf", "xlsx")))


@router.post("/{run_id}/report/copies", status_code=201, dependencies=[IDEMPOTENT])
def keep_run_report(run_id: str, request: CopyRequest, context: Context) -> CopyView:
    """Make the present report on a run, and keep its file, so that it can be read and signed.

    A file without a signature is kept for a day.
    """
    row = context.get_run(run_id)
    subject = Subject("run", row.id)

    def write(out: Path) -> None:
        write_report(context, row, request.format, out)

    signed = list_hashes(context, subject)
    return make_copy_view(subject, keep_report(context.data, subject, request.format, write, signed))


@router.get("/{run_id}/report/copies/{sha256}", response_class=FileResponse, responses=_FILES)
def get_kept_run_report(run_id: str, sha256: str, context: Context) -> SnapshotResponse:
    """Return a kept report, byte by byte as it was signed."""
    return send_report(context, Subject("run", context.get_run(run_id).id), sha256)


@router.get("/{run_id}/report/signatures")
def list_run_signatures(run_id: str, context: Context) -> SignatureList:
    """List the signatures of the reports on a run, the oldest first, each with the state of its file."""
    row = context.get_run(run_id)
    return list_signatures(context, Subject("run", row.id), find_newest_result(context, row))


@router.post("/{run_id}/report/signatures", status_code=201, responses=TOO_MANY)
def sign_run_report(run_id: str, request: SignatureRequest, context: Context, sender: Sender) -> SignatureView:
    """Sign a kept report on a run, with the password of the signed-in person; the audit trail records it."""
    return sign_report(context, Subject("run", context.get_run(run_id).id), request, sender)

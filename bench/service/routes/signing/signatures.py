"""Signature of a kept report: the person signs in again for it, and the audit trail records it."""

import secrets
from datetime import UTC, datetime
from http import HTTPStatus
from urllib.parse import quote

from bench.agent_protocol import get_sender
from bench.audit import make_signature
from bench.catalogue import SignatureRow, UserRow, compute_sha256
from bench.service.access import Identity
from bench.service.context import ServiceContext
from bench.service.problems import ProblemError, make_conflict, make_not_found
from bench.service.requests import check_password_again
from bench.service.routes.signing.kept_reports import KeptReport, Subject, check_file, find_report
from bench.service.routes.signing.views import CopyView, SignatureList, SignatureRequest, SignatureView

_PATHS = {"run": "runs", "campaign": "campaigns"}


def sign_report(
    context: ServiceContext, subject: Subject, request: SignatureRequest, sender: Identity
) -> SignatureView:
    """Sign a kept report, and return the signature.

    Raises:
        ProblemError: the sender is no local person, gives a wrong password, or the report is not as it was kept.
        AuditError: the audit trail cannot be written.
    """
    user = _find_signer(context, sender)
    report = get_report(context, subject, request.sha256)
    if compute_sha256(report.path) != report.sha256:
        detail = f"{report.path.name}: the kept file was altered; make another one, read it and sign that"
        raise make_conflict("report-altered", "The report was altered", detail)
    _check_not_signed(context, subject, request, user)
    check_password_again(context, user, request.password, "password")
    row = _record(context, subject, report, request, user)
    context.catalogue.signatures.add(row)
    return _make_view(context, subject, row, newest=None)


def list_signatures(context: ServiceContext, subject: Subject, newest: datetime | None) -> SignatureList:
    """Return the signatures of the reports on a subject.

    Args:
        context: objects of the service.
        subject: what the reports are about.
        newest: UTC of the newest result; None without one.
    """
    rows = context.catalogue.signatures.list_signatures(*subject)
    return SignatureList(items=tuple(_make_view(context, subject, row, newest) for row in rows))


def get_report(context: ServiceContext, subject: Subject, sha256: str) -> KeptReport:
    """Return the kept report with a hash.

    Raises:
        ProblemError: there is none.
    """
    found = find_report(context.data, subject, sha256)
    if found is None:
        raise make_not_found("kept report", f"{sha256} on {subject.kind} {subject.id}")
    return found


def make_copy_view(subject: Subject, report: KeptReport) -> CopyView:
    """Return the description of a kept report."""
    return CopyView(
        sha256=report.sha256,
        format=report.format,
        size=report.path.stat().st_size,
        made=report.made,
        path=_make_path(subject, report.sha256),
    )


def _find_signer(context: ServiceContext, sender: Identity) -> UserRow:
    """Return the user who signs; tokens are of programs, and a provider asks for passwords itself."""
    row = context.catalogue.users.find(sender.name) if sender.kind == "user" else None
    if row is None:
        detail = f"{sender.full_name} is no person; a person signs in by name and password, and signs then"
        raise ProblemError(HTTPStatus.FORBIDDEN, "person-needed", "A person has to sign", detail)
    if row.external_id is not None:
        detail = (
            f"user {row.name} signs in by the provider, so that the service knows no password to ask for; "
            "a local user has to sign"
        )
        raise ProblemError(HTTPStatus.FORBIDDEN, "external-user", "The provider administers this user", detail)
    return row


def _check_not_signed(context: ServiceContext, subject: Subject, request: SignatureRequest, user: UserRow) -> None:
    wanted = (request.sha256, request.meaning, user.name)
    rows = context.catalogue.signatures.list_signatures(*subject)
    if any((row.sha256, row.meaning, row.user) == wanted for row in rows):
        detail = f"{user.name} has signed this file as {request.meaning} already; nothing was added"
        raise make_conflict("signed-already", "Signed already", detail)


def _record(
    context: ServiceContext, subject: Subject, report: KeptReport, request: SignatureRequest, user: UserRow
) -> SignatureRow:
    """Record a signature in the audit trail, and return its row."""
    sender, full_name = get_sender(), user.full_name or user.name
    content = {
        "sha256": report.sha256,
        "meaning": request.meaning,
        "full_name": full_name,
        "role": user.role,
        "report": subject.kind,
        "format": report.format,
        "made": report.made.isoformat(),
    }
    act = make_signature(f"user:{user.name}", sender.origin, sender.request, subject.id, content)
    entry = context.audit.write_now(act)
    return SignatureRow(
        id=secrets.token_hex(6),
        kind=subject.kind,
        subject=subject.id,
        sha256=report.sha256,
        format=report.format,
        made=report.made,
        user=user.name,
        full_name=full_name,
        meaning=request.meaning,
        signed=datetime.fromisoformat(entry.utc).astimezone(UTC),
        audit_seq=entry.seq,
    )


def _make_view(
    context: ServiceContext, subject: Subject, row: SignatureRow, newest: datetime | None
) -> SignatureView:
    return SignatureView(
        id=row.id,
        sha256=row.sha256,
        format=row.format,
        made=row.made,
        user=row.user,
        full_name=row.full_name,
        meaning=row.meaning,
        signed=row.signed,
        audit_seq=row.audit_seq,
        file=check_file(context.data, subject, row.sha256),
        newer_results=newest is not None and newest > row.made,
        path=_make_path(subject, row.sha256),
    )


def _make_path(subject: Subject, sha256: str) -> str:
    return f"/api/v1/{_PATHS[subject.kind]}/{quote(subject.id, safe='')}/report/copies/{sha256}"

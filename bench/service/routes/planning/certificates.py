"""Routes of calibration certificates: immutable; a correction is a new version, a withdrawn one stays visible."""

from collections.abc import Sequence
from datetime import UTC, datetime
from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from bench.calibration import Certificate, CertificateError, describe_due, parse_certificate
from bench.catalogue import StoredCertificate, find_stored_state
from bench.config import ChannelName
from bench.service.context import Context, ServiceContext
from bench.service.problems import ProblemError, make_conflict, make_not_found
from bench.service.requests import IDEMPOTENT, IdempotentRoute
from bench.service.routes.planning.certificate_views import (
    CertificateCorrection,
    CertificateList,
    CertificateView,
    Reason,
    make_certificate_view,
)
from bench.service.views import BenchChoice

router = APIRouter(prefix="/certificates", tags=["certificates"], route_class=IdempotentRoute)
_TOKEN_HOLDER = "bench"
"""Author of a request with the token of the service."""


@router.get("")
def list_certificates(
    context: Context,
    channel: Annotated[ChannelName | None, Query(description="only those of this channel")] = None,
) -> CertificateList:
    """List the newest version of every certificate, superseded and withdrawn ones included."""
    return _make_list(context, context.catalogue.certificates.list_newest(), channel)


@router.post("", status_code=201, dependencies=[IDEMPOTENT])
def add_certificate(
    certificate: Certificate,
    context: Context,
    request: Request,
    response: Response,
    bench: BenchChoice = None,
) -> CertificateView:
    """Store a certificate. It never changes; runs of its bench that start from now on name it in their log."""
    name = context.benches.get(bench).name
    stored = context.catalogue.certificates.add(certificate, find_author(request), name)
    if stored is None:
        detail = (
            f"certificate {certificate.number} of {certificate.laboratory} for channel {certificate.channel} is "
            "stored already; correct it with PATCH"
        )
        raise make_conflict("certificate-stored", "The certificate is stored", detail)
    response.headers["Location"] = f"/api/v1/certificates/{stored.row.id}"
    return _make_view(context, stored)


@router.get("/{certificate_id}")
def get_certificate(
    certificate_id: str,
    context: Context,
    version: Annotated[int | None, Query(ge=1, description="version; by default the newest")] = None,
) -> CertificateView:
    """Return one version of a certificate."""
    return _make_view(context, _get_stored(context, certificate_id, version))


@router.get("/{certificate_id}/versions")
def list_certificate_versions(certificate_id: str, context: Context) -> CertificateList:
    """List all versions of a certificate, the oldest first."""
    _get_stored(context, certificate_id)
    return _make_list(context, context.catalogue.certificates.list_versions(certificate_id))


@router.patch("/{certificate_id}")
def correct_certificate(
    certificate_id: str, correction: CertificateCorrection, context: Context, request: Request
) -> CertificateView:
    """Store a correction as the next version; channel, laboratory and number stay. No version is lost."""
    stored = _get_present(context, certificate_id)
    document = stored.issued.document.model_dump(mode="json", by_alias=True) | correction.changes
    try:
        corrected = parse_certificate(document, "the corrected certificate")
    except CertificateError as error:
        raise ProblemError(
            HTTPStatus.UNPROCESSABLE_ENTITY, "certificate-refused", "The certificate was refused", str(error)
        ) from None
    author, store = find_author(request), context.catalogue.certificates
    if not store.correct(stored, corrected, author, correction.reason):
        detail = f"certificate {certificate_id} was corrected meanwhile; read it again and repeat the correction"
        raise make_conflict("changed-meanwhile", "Changed meanwhile", detail)
    return get_certificate(certificate_id, context)


@router.delete("/{certificate_id}")
def withdraw_certificate(
    certificate_id: str,
    reason: Annotated[Reason, Query(description="reason of the withdrawal, for people")],
    context: Context,
    request: Request,
) -> CertificateView:
    """Withdraw a certificate with all its versions: it stays visible, and applies to no later run."""
    _get_present(context, certificate_id)
    context.catalogue.certificates.withdraw(certificate_id, find_author(request), reason)
    return get_certificate(certificate_id, context)


def describe_calibration(context: ServiceContext) -> str:
    """Return `ok`, or the channels whose calibration is overdue or due soon, or whose check is out of control."""
    states = {name: _describe_bench(context, name) for name in context.benches.names}
    if not context.benches.are_several:
        return "".join(states.values()) or "ok"
    return "; ".join(f"{name}: {state}" for name, state in states.items() if state) or "ok"


def _describe_bench(context: ServiceContext, bench: str) -> str:
    """Return the channels of a bench that need attention; empty for none."""
    day = datetime.now(UTC).date()
    current = [one.document for one in context.catalogue.certificates.list_current(day, bench).values()]
    by_due = sorted(current, key=lambda certificate: certificate.due)
    due = (describe_due(one, day) for one in by_due)
    checks = (one.text for one in context.catalogue.checks.list_latest(bench) if one.state == "out_of_control")
    return "; ".join(filter(None, (*due, *checks)))


def find_author(request: Request) -> str:
    """Return the user or token of a request; the token of the service has no name of its own."""
    return str(request.scope.get("state", {}).get("actor") or _TOKEN_HOLDER)


def _get_stored(context: ServiceContext, certificate_id: str, version: int | None = None) -> StoredCertificate:
    found = context.catalogue.certificates.find(certificate_id, version)
    if found is None:
        of = "" if version is None else f"version {version} of "
        raise make_not_found(f"{of}certificate", certificate_id)
    return found


def _get_present(context: ServiceContext, certificate_id: str) -> StoredCertificate:
    """Return the newest version of a certificate that is not withdrawn."""
    found = _get_stored(context, certificate_id)
    if found.withdrawal is not None:
        detail = f"certificate {certificate_id} was withdrawn: {found.withdrawal.reason}; add a new certificate"
        raise make_conflict("certificate-withdrawn", "The certificate is withdrawn", detail)
    return found


def _make_view(context: ServiceContext, stored: StoredCertificate) -> CertificateView:
    return _make_list(context, [stored]).items[0]


def _make_list(
    context: ServiceContext, stored: Sequence[StoredCertificate], channel: str | None = None
) -> CertificateList:
    """Return the views of versions; the state is that of the newest version of the certificate."""
    day, store = datetime.now(UTC).date(), context.catalogue.certificates
    newest = {one.row.id: one for one in store.list_newest()}
    current = {bench: store.list_current(day, bench) for bench in {one.row.bench for one in stored}}
    applying = {one.id: describe_due(one.document, day) for found in current.values() for one in found.values()}
    items = (
        make_certificate_view(
            one, find_stored_state(newest[one.row.id], current[one.row.bench], day), applying.get(one.row.id, "")
        )
        for one in stored
        if channel in (None, one.row.channel)
    )
    return CertificateList(items=tuple(items))

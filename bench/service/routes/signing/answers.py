"""Answers that the routes of runs and of campaigns share."""

from typing import Any

from bench.service import problems
from bench.service.context import ServiceContext
from bench.service.files import SnapshotResponse
from bench.service.problems import make_not_found
from bench.service.routes.exchange import MEDIA_TYPES
from bench.service.routes.signing.kept_reports import Subject
from bench.service.routes.signing.signatures import get_report

TOO_MANY: dict[int | str, dict[str, Any]] = {
    429: {**problems.RESPONSES[401], "description": "Too many failed attempts; see Retry-After"}
}
"""Further refusal of a signature."""


def send_report(context: ServiceContext, subject: Subject, sha256: str) -> SnapshotResponse:
    """Return a kept report as the answer of a route.

    Raises:
        ProblemError: there is none.
    """
    found = get_report(context, subject, sha256)
    name = f"{subject.id}.report-{sha256[:12]}.{found.format}"
    try:
        return SnapshotResponse(found.path, MEDIA_TYPES[found.format], name, inline=found.format != "xlsx")
    except FileNotFoundError:
        raise make_not_found("kept report", sha256) from None


def list_hashes(context: ServiceContext, subject: Subject) -> frozenset[str]:
    """Return the hashes of the signed reports on a subject."""
    return frozenset(row.sha256 for row in context.catalogue.signatures.list_signatures(*subject))

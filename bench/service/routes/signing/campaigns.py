"""Routes that keep and sign the report on a campaign."""

from datetime import UTC, datetime
from pathlib import Path

from fastapi import APIRouter
from fastapi.responses import FileResponse

from bench.campaigns import StoredCampaign
from bench.service.context import Context, ServiceContext
from bench.service.files import SnapshotResponse, describe_file
from bench.service.problems import make_not_found
from bench.service.requests import IDEMPOTENT, IdempotentRoute, Sender
from bench.service.routes.campaigns import write_campaign_report
from bench.service.routes.exchange import MEDIA_TYPES
from bench.service.routes.signing.answers import TOO_MANY, list_hashes, send_report
from bench.service.routes.signing.kept_reports import Subject, keep_report
from bench.service.routes.signing.signatures import list_signatures, make_copy_view, sign_report
from bench.service.routes.signing.views import (
    CampaignCopyRequest,
    CopyView,
    SignatureList,
    SignatureRequest,
    SignatureView,
)

router = APIRouter(prefix="/campaigns", tags=["campaigns"], route_class=IdempotentRoute)
_FILES = describe_file(MEDIA_TYPES["html"], MEDIA_TYPES["pdf"])


@router.post("/{campaign_id}/report/copies", status_code=201, dependencies=[IDEMPOTENT])
def keep_campaign_report(campaign_id: str, request: CampaignCopyRequest, context: Context) -> CopyView:
    """Make the present report of a campaign, and keep its file, so that it can be read and signed.

    A file without a signature is kept for a day.
    """
    subject = Subject("campaign", _get(context, campaign_id).id)

    def write(out: Path) -> None:
        write_campaign_report(context, campaign_id, str(out))

    signed = list_hashes(context, subject)
    return make_copy_view(subject, keep_report(context.data, subject, request.format, write, signed))


@router.get("/{campaign_id}/report/copies/{sha256}", response_class=FileResponse, responses=_FILES)
def get_kept_campaign_report(campaign_id: str, sha256: str, context: Context) -> SnapshotResponse:
    """Return a kept report, byte by byte as it was signed."""
    return send_report(context, Subject("campaign", _get(context, campaign_id).id), sha256)


@router.get("/{campaign_id}/report/signatures")
def list_campaign_signatures(campaign_id: str, context: Context) -> SignatureList:
    """List the signatures of the reports of a campaign, the oldest first, each with the state of its file."""
    campaign = _get(context, campaign_id)
    changed = datetime.fromtimestamp(campaign.state.updated, UTC)
    return list_signatures(context, Subject("campaign", campaign.id), changed)


@router.post("/{campaign_id}/report/signatures", status_code=201, responses=TOO_MANY)
def sign_campaign_report(
    campaign_id: str, request: SignatureRequest, context: Context, sender: Sender
) -> SignatureView:
    """Sign a kept report of a campaign, with the password of the signed-in person; the audit trail records it."""
    return sign_report(context, Subject("campaign", _get(context, campaign_id).id), request, sender)


def _get(context: ServiceContext, campaign_id: str) -> StoredCampaign:
    store = context.campaign_store
    if store.table.get(campaign_id) is None:
        raise make_not_found("campaign", campaign_id)
    return store.get(campaign_id)

"""Route that returns the report of a campaign, as page or PDF; also of one that is not finished."""

from typing import Annotated, Any

from fastapi import APIRouter, Query
from fastapi.responses import FileResponse

from bench.campaign_report import CAMPAIGN_REPORT_FORMATS, CampaignReportFormat
from bench.errors import ReportError
from bench.service.context import Context, ServiceContext
from bench.service.problems import make_not_found
from bench.service.routes.exchange import MEDIA_TYPES
from bench.service.transfer import run_command, send_temporary_file

router = APIRouter(prefix="/campaigns", tags=["campaigns"])
_FILES: dict[int | str, dict[str, Any]] = {
    200: {"description": "the report", "content": {MEDIA_TYPES[one]: {} for one in CAMPAIGN_REPORT_FORMATS}}
}


@router.get("/{campaign_id}/report", response_class=FileResponse, responses=_FILES)
def get_campaign_report(
    campaign_id: str,
    context: Context,
    report_format: Annotated[CampaignReportFormat, Query(alias="format", description="page or PDF")] = "html",
) -> FileResponse:
    """Return the report of a campaign with the present results; it is made at the request, in some seconds."""
    if context.campaign_store.table.get(campaign_id) is None:
        raise make_not_found("campaign", campaign_id)

    def write(out: str) -> None:
        write_campaign_report(context, campaign_id, out)

    name = f"{campaign_id}.report.{report_format}"
    return send_temporary_file(context.data, name, MEDIA_TYPES[report_format], write, inline=True)


def write_campaign_report(context: ServiceContext, campaign_id: str, out: str) -> None:
    """Write the present report of a campaign to a file with the ending of its format.

    Raises:
        ReportError: it cannot be made.
    """
    run_command(["campaign", "report", campaign_id, "--data", str(context.data), "--out", out], ReportError)

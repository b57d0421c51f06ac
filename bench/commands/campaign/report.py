"""`mrbench campaign report`: a campaign as one self-contained page or as PDF, also without a service."""

import shlex
from datetime import UTC, datetime
from pathlib import Path

import typer

from bench.campaign_report import CAMPAIGN_REPORT_FORMATS, gather_campaign, write_campaign_report
from bench.campaigns import CampaignError, CampaignStore, StoredCampaign
from bench.commands.campaign.catalogue import open_store
from bench.log import write_atomically


def report(target: str, data: Path, out: str) -> None:
    """Write the report on a campaign.

    Args:
        target: id of the campaign; empty for the newest.
        data: data folder.
        out: file to write; its ending chooses the format.

    Raises:
        BenchError: there is no such campaign, or the file cannot be written.
    """
    path = Path(out)
    report_format = next((one for one in CAMPAIGN_REPORT_FORMATS if path.suffix.lower() == f".{one}"), None)
    if report_format is None:
        raise typer.BadParameter(f"--out {out} does not end with one of .{', .'.join(CAMPAIGN_REPORT_FORMATS)}")
    with open_store(data) as store:
        campaign = _find(store, target)
        content = gather_campaign(store, campaign)
    command = shlex.join(["mrbench", "campaign", "report", campaign.id, "--data", str(data), "--out", out])
    with write_atomically(path) as partial:
        write_campaign_report(content, report_format, partial, command, datetime.now(UTC))
    typer.echo(f"{path}: {path.stat().st_size / 1e6:.1f} MB, report on {campaign.id}", err=True)


def _find(store: CampaignStore, target: str) -> StoredCampaign:
    """Return a campaign by its id, or the newest one."""
    if target:
        return store.get(target)
    found = store.list_campaigns(1)
    if not found:
        raise CampaignError(f"{store.catalogue.folder} has no campaign; start one: mrbench campaign run FILE")
    return found[0]

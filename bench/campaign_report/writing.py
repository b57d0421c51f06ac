"""Campaign report as a file: a self-contained page or a PDF, with the same texts, tables and plots."""

from datetime import datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal, TypeAlias, get_args

from bench.campaign_report.calibration_sections import make_calibrated_results, make_calibration
from bench.campaign_report.content import CampaignReport
from bench.campaign_report.findings import make_findings, make_key_figures
from bench.campaign_report.photos import name_photo
from bench.campaign_report.plots import make_pictures
from bench.campaign_report.record import (
    make_answers,
    make_conditions,
    make_head_rows,
    make_messages,
    make_setup_steps,
    make_steps,
)
from bench.campaign_report.results import make_errors, make_results, make_scatter, make_trends
from bench.report.layout import Picture, Section, Table, make_environment, write_document

CampaignReportFormat: TypeAlias = Literal["html", "pdf"]
CAMPAIGN_REPORT_FORMATS: tuple[CampaignReportFormat, ...] = get_args(CampaignReportFormat)


def make_sections(report: CampaignReport) -> list[Section]:
    """Make the sections after the summary, in order."""
    return [
        make_conditions(report),
        make_calibration(report),
        make_errors(report),
        make_results(report),
        make_calibrated_results(report),
        make_trends(report),
        make_scatter(report),
        make_steps(report),
        make_setup_steps(report),
        make_answers(report),
        make_messages(report),
    ]


def write_campaign_report(
    report: CampaignReport, report_format: CampaignReportFormat, path: Path, command: str, created_at: datetime
) -> None:
    """Write a campaign report.

    Args:
        report: content.
        report_format: html or pdf.
        path: file to write.
        command: command line that writes it.
        created_at: time at which it is written.

    Raises:
        ReportError: the file cannot be written.
    """
    photos = {name_photo(item): photo for item, photo in report.photos.items()}
    pictures = make_pictures(report) | photos
    origin = f"Created {created_at:%Y-%m-%d %H:%M} UTC with mrbench {version('mrbench')}"
    if report_format == "html":
        path.write_text(_render(report, pictures, origin, command), encoding="utf-8")
        return
    sections = [*_make_front(report), *make_sections(report), Section("Provenance", [f"{origin}: {command}"])]
    write_document(report.view.name, "campaign report", sections, pictures, path)


def _render(report: CampaignReport, pictures: dict[str, Picture], origin: str, command: str) -> str:
    values: dict[str, Any] = {
        "title": report.view.name,
        "head": make_head_rows(report),
        "key_figures": make_key_figures(report),
        "findings": make_findings(report),
        "sections": make_sections(report),
        "pictures": pictures,
        "origin": origin,
        "command": command,
    }
    return make_environment("bench.campaign_report").get_template("campaign.html").render(values)


def _make_front(report: CampaignReport) -> list[Section]:
    """Make head and summary of a document, which the page shows in a layout of its own."""
    figures = [(name, value) for value, name in make_key_figures(report)]
    findings = [f"• {finding.text}" for finding in make_findings(report)]
    return [
        Section("The campaign", tables=[Table(make_head_rows(report))]),
        Section("Summary", findings, [Table(figures)]),
    ]

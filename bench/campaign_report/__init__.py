"""Campaign reports: conditions, results, drift, outliers, scatter and steps of one campaign, as a file."""

from bench.campaign_report.content import CampaignReport, gather_campaign
from bench.campaign_report.writing import CAMPAIGN_REPORT_FORMATS, CampaignReportFormat, write_campaign_report

__all__ = [
    "CAMPAIGN_REPORT_FORMATS",
    "CampaignReport",
    "CampaignReportFormat",
    "gather_campaign",
    "write_campaign_report",
]

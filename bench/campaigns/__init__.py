"""Campaigns: ordered runs with rests and conditions between them, resumed after anything."""

from bench.campaigns.document import (
    Campaign,
    CampaignError,
    CampaignPlan,
    collect_methods,
    format_plan,
    load_campaign,
    parse_campaign,
    plan_campaign,
)

__all__ = [
    "Campaign",
    "CampaignError",
    "CampaignPlan",
    "collect_methods",
    "format_plan",
    "load_campaign",
    "parse_campaign",
    "plan_campaign",
]

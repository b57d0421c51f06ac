"""Campaigns: ordered runs with rests and conditions between them, resumed after anything."""

from bench.campaigns.benches import CampaignBench, PlantBench
from bench.campaigns.document import (
    Campaign,
    CampaignError,
    CampaignPlan,
    collect_methods,
    expand_campaign,
    format_plan,
    load_campaign,
    parse_campaign,
    plan_campaign,
)
from bench.campaigns.engine import CampaignState, Message, answer, parse_choice, pause, resume, stop
from bench.campaigns.runner import CampaignRunner, lock_campaign
from bench.campaigns.store import CampaignStore, StoredCampaign
from bench.campaigns.view import CampaignView, format_view, make_view

__all__ = [
    "Campaign",
    "CampaignBench",
    "CampaignError",
    "CampaignPlan",
    "CampaignRunner",
    "CampaignState",
    "CampaignStore",
    "CampaignView",
    "Message",
    "PlantBench",
    "StoredCampaign",
    "answer",
    "collect_methods",
    "expand_campaign",
    "format_plan",
    "format_view",
    "load_campaign",
    "lock_campaign",
    "make_view",
    "parse_campaign",
    "parse_choice",
    "pause",
    "plan_campaign",
    "resume",
    "stop",
]

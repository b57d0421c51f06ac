"""Campaigns: ordered runs with rests and conditions between them, resumed after anything."""

from bench.campaigns.benches import AgentBench, CampaignBench, PlantBench, Thermometer
from bench.campaigns.document import (
    AnyStep,
    Campaign,
    CampaignDocumentError,
    CampaignError,
    CampaignPlan,
    collect_methods,
    expand_campaign,
    format_plan,
    load_campaign,
    parse_campaign,
    plan_campaign,
)
from bench.campaigns.engine import (
    CampaignState,
    Choice,
    Message,
    QueueEdit,
    answer,
    apply_edit,
    needs_results,
    parse_choice,
    pause,
    resume,
    stop,
)
from bench.campaigns.notifications import make_test_content, send_all
from bench.campaigns.runner import CampaignRunner, lock_campaign
from bench.campaigns.store import CampaignStore, StoredCampaign
from bench.campaigns.view import CampaignView, ItemView, format_view, make_view

__all__ = [
    "AgentBench",
    "AnyStep",
    "Campaign",
    "CampaignBench",
    "CampaignDocumentError",
    "CampaignError",
    "CampaignPlan",
    "CampaignRunner",
    "CampaignState",
    "CampaignStore",
    "CampaignView",
    "Choice",
    "ItemView",
    "Message",
    "PlantBench",
    "QueueEdit",
    "StoredCampaign",
    "Thermometer",
    "answer",
    "apply_edit",
    "collect_methods",
    "expand_campaign",
    "format_plan",
    "format_view",
    "load_campaign",
    "lock_campaign",
    "make_test_content",
    "make_view",
    "needs_results",
    "parse_campaign",
    "parse_choice",
    "pause",
    "plan_campaign",
    "resume",
    "send_all",
    "stop",
]

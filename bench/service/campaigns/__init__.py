"""Campaigns in the service: their executor on the rig agent."""

from bench.service.campaigns.executor import AGENT_BENCH, CampaignExecutor

__all__ = ["AGENT_BENCH", "CampaignExecutor"]

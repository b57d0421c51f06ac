"""Campaigns in the service: their executor on the rig agent."""

from bench.service.campaigns.executor import CampaignExecutor

__all__ = ["CampaignExecutor"]

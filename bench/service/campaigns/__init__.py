"""Campaigns in the service: their executor on the rig agent, and the state of the workers that they need."""

from bench.service.campaigns.executor import CampaignExecutor
from bench.service.campaigns.worker_state import WorkerState

__all__ = ["CampaignExecutor", "WorkerState"]

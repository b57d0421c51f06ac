"""Routes of campaigns and of the queue of the bench, with their models."""

from bench.service.routes.campaigns import reports, routes
from bench.service.routes.campaigns.reports import write_campaign_report

ROUTERS = (routes.router, reports.router)
"""Routers of campaigns."""

__all__ = ["ROUTERS", "write_campaign_report"]

"""Routes of campaigns and of the queue of the bench, with their models."""

from bench.service.routes.campaigns import reports, routes

ROUTERS = (routes.router, reports.router)
"""Routers of campaigns."""

__all__ = ["ROUTERS"]

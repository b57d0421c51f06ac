"""Routes that keep reports as files, and sign them."""

from bench.service.routes.signing import campaigns, runs

ROUTERS = (runs.router, campaigns.router)
"""Routers of signatures."""

__all__ = ["ROUTERS"]

"""REST routes, one module for each resource."""

from bench.service.routes import jobs, live, methods, rig, runs

PUBLIC_ROUTERS = (rig.public_router, live.router)
"""Routers that answer without a token."""
PROTECTED_ROUTERS = (rig.router, methods.router, runs.router, jobs.router)
"""Routers that ask for a token."""

__all__ = ["PROTECTED_ROUTERS", "PUBLIC_ROUTERS"]

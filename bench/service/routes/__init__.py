"""REST routes, one module for each resource."""

from bench.service.routes import jobs, live, methods, rig, runs

PUBLIC_ROUTERS = (rig.public_router, live.router)
"""Routers that need no token in the header; `live` checks its own."""
PROTECTED_ROUTERS = (rig.router, methods.router, runs.router, jobs.router)
"""Routers that need the token."""

__all__ = ["PROTECTED_ROUTERS", "PUBLIC_ROUTERS"]

"""REST routes, one module for each resource."""

from bench.service.routes import (
    analyses,
    audit,
    batches,
    benches,
    campaigns,
    continuation,
    exchange,
    health,
    integrity,
    jobs,
    live,
    metrics,
    people,
    planning,
    recordings,
    results,
    run_files,
    runs,
    signing,
)
from bench.service.routes.unknown_paths import refuse_unknown_paths

PUBLIC_ROUTERS = (health.router, live.router, *people.PUBLIC_ROUTERS)
"""Routers that need no sign-in; `live` checks its own first message."""
PROTECTED_ROUTERS = (
    *benches.ROUTERS,
    metrics.router,
    *people.ROUTERS,
    *planning.ROUTERS,
    runs.router,
    continuation.router,
    integrity.router,
    run_files.router,
    results.router,
    jobs.router,
    batches.router,
    *exchange.ROUTERS,
    *signing.ROUTERS,
    *recordings.ROUTERS,
    *campaigns.ROUTERS,
    *analyses.ROUTERS,
    audit.router,
)
"""Routers that need a sign-in."""

__all__ = ["PROTECTED_ROUTERS", "PUBLIC_ROUTERS", "refuse_unknown_paths"]

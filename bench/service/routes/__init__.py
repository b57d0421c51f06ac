"""REST routes, one module for each resource."""

from bench.service.routes import (
    analyses,
    audit,
    batches,
    bench_control,
    campaigns,
    continuation,
    exchange,
    health,
    integrity,
    jobs,
    live,
    metrics,
    planning,
    recordings,
    results,
    run_files,
    runs,
)
from bench.service.routes.unknown_paths import refuse_unknown_paths

PUBLIC_ROUTERS = (health.router, live.router)
"""Routers that need no token in the header; `live` checks its own."""
PROTECTED_ROUTERS = (
    bench_control.router,
    metrics.router,
    *planning.ROUTERS,
    runs.router,
    continuation.router,
    integrity.router,
    run_files.router,
    results.router,
    jobs.router,
    batches.router,
    *exchange.ROUTERS,
    *recordings.ROUTERS,
    *campaigns.ROUTERS,
    *analyses.ROUTERS,
    audit.router,
)
"""Routers that need the token."""

__all__ = ["PROTECTED_ROUTERS", "PUBLIC_ROUTERS", "refuse_unknown_paths"]

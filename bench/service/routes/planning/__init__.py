"""Routes of planning: methods with their dry runs, specimens, certificates, checks, facts of the bench."""

from bench.service.routes.planning import (
    bench_facts,
    certificates,
    checks,
    dry_runs,
    methods,
    previews,
    specimens,
    trends,
)
from bench.service.routes.planning.certificates import describe_calibration
from bench.service.routes.planning.method_library import find_method

BENCH_ROUTER = bench_facts.router
"""Routes below the path of a bench."""
ROUTERS = (
    certificates.router,
    checks.router,
    previews.router,
    dry_runs.router,
    methods.router,
    trends.router,
    specimens.router,
)
"""All routers; those with longer paths come first."""

__all__ = ["BENCH_ROUTER", "ROUTERS", "describe_calibration", "find_method"]

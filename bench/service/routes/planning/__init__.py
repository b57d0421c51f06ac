"""Routes of planning: methods with their dry runs, specimens, and the facts of the bench."""

from bench.service.routes.planning import bench_facts, dry_runs, methods, previews, specimens, trends
from bench.service.routes.planning.method_library import find_method

ROUTERS = (
    bench_facts.router,
    previews.router,
    dry_runs.router,
    methods.router,
    trends.router,
    specimens.router,
)
"""All routers; those with longer paths come first."""

__all__ = ["ROUTERS", "find_method"]

"""Routes of planning: methods with their dry runs, specimens, certificates, checks."""

from bench.service.routes.planning import (
    certificates,
    checks,
    dry_runs,
    methods,
    previews,
    specimens,
    trends,
)
from bench.service.routes.planning.assessments import assess_programme
from bench.service.routes.planning.certificates import describe_calibration
from bench.service.routes.planning.method_library import find_method

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

__all__ = ["ROUTERS", "assess_programme", "describe_calibration", "find_method"]

"""REST routes that compare runs, and show and request simulations of them."""

from bench.service.routes.analyses import calibration, comparisons, predictions

ROUTERS = (calibration.router, comparisons.router, predictions.router)

__all__ = ["ROUTERS"]

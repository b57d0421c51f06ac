"""REST routes that compare runs, and show and request simulations of them."""

from bench.service.routes.analyses import comparisons, predictions

ROUTERS = (comparisons.router, predictions.router)

__all__ = ["ROUTERS"]

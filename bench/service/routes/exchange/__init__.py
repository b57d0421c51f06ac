"""REST routes that take recordings made elsewhere, and return recordings and reports in other formats."""

from bench.service.routes.exchange import exports, reports, uploads
from bench.service.routes.exchange.offers import MEDIA_TYPES, list_offers

ROUTERS = (uploads.router, exports.router, reports.router)

__all__ = ["MEDIA_TYPES", "ROUTERS", "list_offers"]

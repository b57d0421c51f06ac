"""REST routes that take recordings made elsewhere, and return recordings and reports in other formats."""

from bench.service.routes.exchange import exports, reports, uploads
from bench.service.routes.exchange.offers import MEDIA_TYPES, list_offers
from bench.service.routes.exchange.reports import find_newest_result, write_report

ROUTERS = (uploads.router, exports.router, reports.router)

__all__ = ["MEDIA_TYPES", "ROUTERS", "find_newest_result", "list_offers", "write_report"]

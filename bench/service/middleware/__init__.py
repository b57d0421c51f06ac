"""ASGI middleware: log, audit trail, metrics, check of access, limit on bodies, headers, HEAD, kept answers."""

from bench.service.middleware.access_check import CSRF_HEADER, AccessCheckMiddleware
from bench.service.middleware.audit_record import AuditMiddleware
from bench.service.middleware.body_limit import MAX_BODY_SIZE, BodyLimitMiddleware
from bench.service.middleware.head import HeadMiddleware
from bench.service.middleware.kept_answers import KeptAnswerMiddleware
from bench.service.middleware.request_log import RequestLogMiddleware
from bench.service.middleware.request_metrics import RequestMetricsMiddleware
from bench.service.middleware.security_headers import SecurityHeadersMiddleware

__all__ = [
    "CSRF_HEADER",
    "MAX_BODY_SIZE",
    "AccessCheckMiddleware",
    "AuditMiddleware",
    "BodyLimitMiddleware",
    "HeadMiddleware",
    "KeptAnswerMiddleware",
    "RequestLogMiddleware",
    "RequestMetricsMiddleware",
    "SecurityHeadersMiddleware",
]

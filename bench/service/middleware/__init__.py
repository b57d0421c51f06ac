"""ASGI middleware: log of requests, check of the token, limit on the size of bodies, headers for browsers."""

from bench.service.middleware.body_limit import MAX_BODY_SIZE, BodyLimitMiddleware
from bench.service.middleware.request_log import RequestLogMiddleware
from bench.service.middleware.security_headers import SecurityHeadersMiddleware
from bench.service.middleware.token_check import TokenCheckMiddleware

__all__ = [
    "MAX_BODY_SIZE",
    "BodyLimitMiddleware",
    "RequestLogMiddleware",
    "SecurityHeadersMiddleware",
    "TokenCheckMiddleware",
]

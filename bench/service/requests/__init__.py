"""Common parts of requests: known query parameters, and keys that make a repetition harmless."""

from bench.service.requests.idempotency import IDEMPOTENT, IdempotentRoute, find_first_request
from bench.service.requests.query_check import refuse_unknown_parameters

__all__ = ["IDEMPOTENT", "IdempotentRoute", "find_first_request", "refuse_unknown_parameters"]

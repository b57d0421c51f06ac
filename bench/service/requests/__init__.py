"""Common parts of requests: known query parameters, and keys that make a repetition harmless."""

from bench.service.requests.idempotency import IDEMPOTENT, IdempotentRoute, find_first_request
from bench.service.requests.query_check import refuse_unknown_parameters
from bench.service.requests.sender import Sender, get_author, get_operator, require_right

__all__ = [
    "IDEMPOTENT",
    "IdempotentRoute",
    "Sender",
    "find_first_request",
    "get_author",
    "get_operator",
    "refuse_unknown_parameters",
    "require_right",
]

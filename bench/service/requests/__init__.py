"""Common parts of requests: sender, password, known query parameters, keys that make a repetition harmless."""

from bench.service.requests.idempotency import IDEMPOTENT, IdempotentRoute, find_first_request
from bench.service.requests.password_check import check_password_again, check_wait
from bench.service.requests.query_check import refuse_unknown_parameters
from bench.service.requests.sender import Sender, get_author, get_operator, require_right

__all__ = [
    "IDEMPOTENT",
    "IdempotentRoute",
    "Sender",
    "check_password_again",
    "check_wait",
    "find_first_request",
    "get_author",
    "get_operator",
    "refuse_unknown_parameters",
    "require_right",
]

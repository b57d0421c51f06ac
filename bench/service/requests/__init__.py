"""Common parts of requests: sender, password, query parameters, times, keys that make a repetition harmless."""

from bench.service.requests.idempotency import IDEMPOTENT, IdempotentRoute, find_first_request
from bench.service.requests.password_check import check_password_again, check_wait
from bench.service.requests.query_check import refuse_unknown_parameters
from bench.service.requests.sender import Sender, get_author, get_operator, require_right
from bench.service.requests.zoned_time import ZonedTime

__all__ = [
    "IDEMPOTENT",
    "IdempotentRoute",
    "Sender",
    "ZonedTime",
    "check_password_again",
    "check_wait",
    "find_first_request",
    "get_author",
    "get_operator",
    "refuse_unknown_parameters",
    "require_right",
]

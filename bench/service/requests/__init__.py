"""Common parts of requests: sender, password, query, times, keys against repetition, conditions on tags."""

from bench.service.requests.conditional import (
    NOT_MODIFIED,
    PRECONDITIONS,
    ExpectedTag,
    KnownTags,
    is_expected,
    is_known,
    make_not_modified,
    make_tag,
    send_unless_known,
)
from bench.service.requests.idempotency import IDEMPOTENT, IdempotentRoute, find_first_request
from bench.service.requests.password_check import check_password_again, check_wait
from bench.service.requests.query_check import refuse_unknown_parameters
from bench.service.requests.sender import Sender, get_author, get_operator, require_right
from bench.service.requests.zoned_time import ZonedTime

__all__ = [
    "IDEMPOTENT",
    "NOT_MODIFIED",
    "PRECONDITIONS",
    "ExpectedTag",
    "IdempotentRoute",
    "KnownTags",
    "Sender",
    "ZonedTime",
    "check_password_again",
    "check_wait",
    "find_first_request",
    "get_author",
    "get_operator",
    "is_expected",
    "is_known",
    "make_not_modified",
    "make_tag",
    "refuse_unknown_parameters",
    "require_right",
    "send_unless_known",
]

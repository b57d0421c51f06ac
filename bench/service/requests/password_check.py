"""Check of the password of a person who is signed in, for what needs it again."""

import math
from http import HTTPStatus

from pydantic import SecretStr

from bench.catalogue import UserRow
from bench.people import is_password
from bench.service.context import ServiceContext
from bench.service.problems import ProblemError


def check_wait(wait: float) -> None:
    """Refuse an attempt after too many failures.

    Args:
        wait: time until the next attempt is accepted [s].

    Raises:
        ProblemError: it is not zero.
    """
    if wait > 0:
        seconds = math.ceil(wait)
        detail = f"too many sign-ins failed; wait {seconds} s and try again"
        raise ProblemError(
            HTTPStatus.TOO_MANY_REQUESTS,
            "too-many-attempts",
            "Too many attempts",
            detail,
            headers={"Retry-After": str(seconds)},
        )


def check_password_again(context: ServiceContext, row: UserRow, given: SecretStr | None, field: str) -> None:
    """Check the present password of a user; failures count as at a sign-in, with the same wait.

    Args:
        context: objects of the service.
        row: the user.
        given: password of the request.
        field: its field, for the error.

    Raises:
        ProblemError: the password is wrong, or there were too many failures before.
    """
    key = f"user:{row.name}"
    check_wait(context.attempts.get_wait(key))
    if given is None or not is_password(given.get_secret_value(), row.password_hash):
        context.attempts.record_failure(key)
        detail = f"{field}: give the present password of {row.name}; after several failures there is a wait"
        raise ProblemError(HTTPStatus.FORBIDDEN, "wrong-password", "The present password is wrong", detail)
    context.attempts.record_success(key)

"""The sender of a request, for routes that need more than the check of the middleware."""

from typing import Annotated

from fastapi import Depends, Request

from bench.people import Right
from bench.service.access import Identity
from bench.service.problems import make_right_missing, make_unauthorised


def _get_sender(request: Request) -> Identity:
    identity: Identity | None = getattr(request.state, "identity", None)
    if identity is None:
        raise make_unauthorised()
    return identity


Sender = Annotated[Identity, Depends(_get_sender)]
"""Parameter of a route: who sends the request."""


def get_author(sender: Identity, given: str) -> str:
    """Return the name of who makes a record: that of the signed-in person, else the given one."""
    return sender.full_name if sender.kind == "user" else given


def get_operator(sender: Identity, given: str) -> str:
    """Return the given name of an operator, who may be another person; by default the signed-in one."""
    return given or get_author(sender, "")


def require_right(sender: Identity, right: Right) -> None:
    """Check that a sender has a right.

    Raises:
        ProblemError: it lacks the right.
    """
    if right not in sender.rights:
        raise make_right_missing(right, sender)

"""Identity of the sender of a request."""

import hashlib
import hmac
from dataclasses import dataclass
from datetime import datetime
from typing import Literal, TypeAlias

from bench.people import Right, Role, compute_rights

IdentityKind: TypeAlias = Literal["bench", "user", "token"]
"""bench: the holder of the bench's own token; token: a program."""


@dataclass(frozen=True)
class Identity:
    """Person or program that sends a request."""

    kind: IdentityKind
    name: str
    """Name of the user, label of the token, or ``bench``."""
    full_name: str
    role: Role
    rights: frozenset[Right]
    subject: str
    """Name of the user, or hash of the token."""
    session: str | None = None
    """Hash of the session; None for a request with a token."""
    expires: datetime | None = None
    """UTC at which session or token ends; None if it does not."""

    @property
    def actor(self) -> str:
        """Name for the record of what was done, such as ``user:mcurie``."""
        return "bench" if self.kind == "bench" else f"{self.kind}:{self.name}"


def make_bench_identity(sha256: str) -> Identity:
    """Return the identity of the holder of the bench's token."""
    role: Role = "administrator"
    return Identity("bench", "bench", "Holder of the bench's token", role, compute_rights(role), sha256)


def compute_csrf(secret: str) -> str:
    """Return the value that requests with the session of this cookie send in ``X-CSRF-Token``.

    Another site can have the cookie sent, but can neither read it nor compute this value.
    """
    return hmac.new(secret.encode(), b"csrf", hashlib.sha256).hexdigest()

"""Who may talk to the service: whoever has the token that was printed once."""

import hashlib
import hmac
import os
import secrets
from pathlib import Path

TOKEN_FILE = "token.sha256"
"""In the data folder; holds what the token is checked against, not the token."""


class Access:
    """Knows a token by its hash.

    The token is 256 random bits, so a plain hash of it tells as little as a slow one.
    """

    def __init__(self, sha256: str) -> None:
        self._sha256 = sha256

    def is_allowed(self, token: str) -> bool:
        """Whether this is the token; takes as long for every wrong one."""
        return hmac.compare_digest(_compute_sha256(token), self._sha256)


def open_access(data: Path, *, new: bool = False) -> tuple[Access, str | None]:
    """The access to the service of a data folder.

    Args:
        data: the folder.
        new: make another token; the old one opens nothing any more.

    Returns:
        The access, and the token if it was made now; later it cannot be had.
    """
    path = data / TOKEN_FILE
    if path.exists() and not new:
        return Access(path.read_text("ascii").strip()), None
    token = secrets.token_urlsafe(32)
    _write_privately(path, _compute_sha256(token))
    return Access(_compute_sha256(token)), token


def _compute_sha256(token: str) -> str:
    return hashlib.sha256(token.encode()).hexdigest()


def _write_privately(path: Path, text: str) -> None:
    """Write a file that nobody else could read at any moment."""
    path.unlink(missing_ok=True)
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="ascii") as file:
        file.write(text)

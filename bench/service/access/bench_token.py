"""The bench's own token, whose holder administers the service.

It is shown once on a terminal, or kept in a file that only its owner can read.
"""

import hmac
import os
from pathlib import Path

from bench.people import compute_sha256, new_secret

TOKEN_FILE = "token.sha256"
"""File in the data folder with the hash of the token, not the token itself."""
PLAIN_TOKEN_FILE = "token"
"""File in the data folder with the token, for a service without a terminal; only its owner can read it."""


class Access:
    """Check of tokens against the hash of the valid one.

    The token has 256 random bits, so a fast hash is as safe as a slow one.
    """

    def __init__(self, sha256: str) -> None:
        self._sha256 = sha256

    def is_allowed(self, token: str) -> bool:
        """Return whether a token is valid, in a time that does not depend on its content."""
        return self.is_hash(compute_sha256(token))

    def is_hash(self, sha256: str) -> bool:
        """Return whether this is the hash of the valid token."""
        return hmac.compare_digest(sha256, self._sha256)


def open_access(data: Path, *, new: bool = False) -> tuple[Access, str | None]:
    """Open the access to the service of a data folder.

    Args:
        data: data folder.
        new: replace the token; the old one becomes invalid.

    Returns:
        The access, and the token if it was created now; it cannot be recovered later.
    """
    path = data / TOKEN_FILE
    if path.exists() and not new:
        return Access(path.read_text("ascii").strip()), None
    token, sha256 = new_secret()
    (data / PLAIN_TOKEN_FILE).unlink(missing_ok=True)  # it contains the old one
    _write_privately(path, sha256)
    return Access(sha256), token


def save_token(data: Path, token: str) -> Path:
    """Write the token into a file that only its owner can read, and return its path."""
    path = data / PLAIN_TOKEN_FILE
    _write_privately(path, token)
    return path


def _write_privately(path: Path, text: str) -> None:
    """Write a file that other users cannot read at any time."""
    path.unlink(missing_ok=True)
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="ascii") as file:
        file.write(text)

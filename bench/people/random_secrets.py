"""Random secrets of tokens and sessions."""

import hashlib
import secrets


def new_secret() -> tuple[str, str]:
    """Return a new random secret of 256 bits, and the hash under which it is stored."""
    secret = secrets.token_urlsafe(32)
    return secret, compute_sha256(secret)


def compute_sha256(secret: str) -> str:
    """Return the hash of a random secret; one with 256 bits needs no slow hash."""
    return hashlib.sha256(secret.encode()).hexdigest()

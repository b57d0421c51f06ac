"""Passwords, stored as Argon2id hashes (RFC 9106) by argon2-cffi."""

from functools import cache

from argon2 import PasswordHasher
from argon2.exceptions import Argon2Error, InvalidHashError

MIN_LENGTH = 12
"""Smallest number of characters; length counts for more than kinds of characters (NIST SP 800-63B, 5.1.1)."""
MAX_LENGTH = 200
"""Largest number of characters, so that nobody makes the service hash megabytes."""


def check_password(password: str, name: str) -> str:
    """Return a new password unchanged if it may be used.

    Args:
        password: the new password.
        name: name of its user.

    Raises:
        ValueError: it is too short or too long, has one character only, or contains the name.
    """
    if not MIN_LENGTH <= len(password) <= MAX_LENGTH:
        raise ValueError(f"the password has {len(password)} characters; give {MIN_LENGTH} to {MAX_LENGTH}")
    if len(set(password)) < 4:
        raise ValueError("the password has fewer than 4 different characters; give a less regular one")
    if name.lower() in password.lower():
        raise ValueError("the password contains the name of its user; give another one")
    return password


def hash_password(password: str) -> str:
    """Return the hash of a password, with its salt and its costs."""
    return PasswordHasher().hash(password)


def is_password(password: str, stored: str | None) -> bool:
    """Return whether a password belongs to a stored hash.

    Without a stored hash the same time is spent, so that the time does not reveal which names exist.
    """
    try:
        PasswordHasher().verify(stored or _hash_nothing(), password[:MAX_LENGTH])
    except (Argon2Error, InvalidHashError):
        return False
    return stored is not None


@cache
def _hash_nothing() -> str:
    return hash_password("the password of nobody")

"""Values of entries: without secrets, and short."""

import hashlib
import math
from collections.abc import Mapping, Sequence
from typing import Any, Final
from urllib.parse import urlsplit

from bench.audit.entry import encode_canonically

HIDDEN: Final = "…"
"""Text in place of a secret."""
MAX_TEXT: Final = 1000
"""Largest number of characters of a text."""
MAX_VALUE: Final = 8000
"""Largest size of a whole value [bytes]."""
_SECRETS = (
    "password",
    "passphrase",
    "token",
    "secret",
    "csrf",
    "authorization",
    "cookie",
    "private_key",
    "api_key",
)
"""Parts of names whose values are secret."""
_SECRET_NAMES = ("code", "key")
"""Whole names whose values are secret: a sign-in code, an access key."""
_ADDRESSES = ("webhook", "url")
"""Names of addresses, whose path may contain a secret of the recipient."""
_MAX_DEPTH = 32
_LARGEST = 2**63 - 1
"""Largest integer that other programs read, too."""
_SHOWN = 200
"""Number of characters that remain of a text that is too long."""


def redact(value: Any) -> Any:
    """Return a JSON value without secrets; a large one as its size and hash."""
    plain = _redact(value, _MAX_DEPTH)
    encoded = encode_canonically(plain)
    if len(encoded) <= MAX_VALUE:
        return plain
    return {"bytes": len(encoded), "sha256": hashlib.sha256(encoded).hexdigest(), **_name(plain)}


def shorten_text(text: str, longest: int = MAX_TEXT) -> str:
    """Return a text, or its beginning with its length and hash if it is too long; halves of characters escaped."""
    encoded = text.encode("utf-8", "backslashreplace")
    text = encoded.decode()
    if len(text) <= longest:
        return text
    digest = hashlib.sha256(encoded).hexdigest()
    return f"{text[: min(_SHOWN, longest)]}… ({len(text)} characters, sha256 {digest})"


def _redact(value: Any, depth: int) -> Any:
    if depth == 0:
        return HIDDEN
    if isinstance(value, Mapping):
        return {shorten_text(str(name)): _redact_member(str(name), one, depth - 1) for name, one in value.items()}
    if isinstance(value, str):
        return shorten_text(value)
    if isinstance(value, Sequence) and not isinstance(value, bytes):
        return [_redact(one, depth - 1) for one in value]
    if value is None or isinstance(value, bool) or (isinstance(value, int) and abs(value) <= _LARGEST):
        return value
    return value if isinstance(value, float) and math.isfinite(value) else shorten_text(str(value))


def _redact_member(name: str, value: Any, depth: int) -> Any:
    lowered = name.lower()
    is_secret = lowered in _SECRET_NAMES or any(part in lowered for part in _SECRETS)
    if is_secret and value not in (None, "", False, True):
        return HIDDEN
    if lowered in _ADDRESSES and isinstance(value, str):
        return _hide_path(value)
    return _redact(value, depth)


def _hide_path(address: str) -> str:
    """Return scheme and host of an address."""
    try:
        parts = urlsplit(address)
    except ValueError:
        return HIDDEN
    return f"{parts.scheme}://{parts.hostname}/{HIDDEN}" if parts.hostname else HIDDEN


def _name(value: Any) -> dict[str, Any]:
    """Return the names in a large value that say what it is."""
    if not isinstance(value, Mapping):
        return {}
    return {key: one for key, one in value.items() if key in ("name", "schema", "title") and isinstance(one, str)}

"""Sign-ins that have begun, and whose browser is at the provider."""

import hmac
import secrets
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from threading import Lock

from bench.people import compute_sha256, new_secret

PENDING_LIFETIME = 600
"""Time for the sign-in at the provider [s]."""
_MAX_PENDING = 10_000
"""Largest number of sign-ins in memory; the oldest are forgotten."""


@dataclass(frozen=True)
class PendingSignIn:
    """One sign-in that has begun."""

    state: str
    """Random text that the provider returns with its code."""
    nonce: str
    """Random text that the provider puts into the ID token."""
    verifier: str
    """Secret whose hash the provider has, so that nobody else can use its code (RFC 7636)."""
    browser: str
    """Hash of the secret in the cookie of the browser that has begun it."""
    redirect_uri: str
    view: str
    """Address within the page that is shown afterwards."""
    until: float
    """End on the clock of all pending sign-ins [s]."""


class PendingSignIns:
    """Pending sign-ins in memory, each ended once; safe from any thread."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Use a clock [s] that never steps back."""
        self._clock, self._lock = clock, Lock()
        self._pending: OrderedDict[str, PendingSignIn] = OrderedDict()

    def begin(self, redirect_uri: str, view: str) -> tuple[PendingSignIn, str]:
        """Begin a sign-in, and return it with the secret for the browser's cookie."""
        secret, browser = new_secret()
        state, nonce, verifier = (secrets.token_urlsafe(32) for _ in range(3))
        until = self._clock() + PENDING_LIFETIME
        begun = PendingSignIn(state, nonce, verifier, browser, redirect_uri, view, until)
        with self._lock:
            self._pending[state] = begun
            if len(self._pending) > _MAX_PENDING:
                self._pending.popitem(last=False)
        return begun, secret

    def take(self, state: str, secret: str) -> PendingSignIn | None:
        """Return the sign-in of a state and end it; None if it is unknown, too old, or of another browser."""
        with self._lock:
            found = self._pending.pop(state, None)
        if found is None or found.until <= self._clock():
            return None
        return found if hmac.compare_digest(found.browser, compute_sha256(secret)) else None

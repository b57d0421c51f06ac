"""Short codes by which a signed-in person signs in on another device, such as a tablet at the bench."""

import secrets
import time
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from threading import Lock
from typing import Generic, TypeVar

CODE_LIFETIME = 120.0
"""Time in which a code can be used [s]."""
_DIGITS = 8
_MAX_CODES = 100
"""Largest number of codes at a time; with 10⁸ codes and waits after failures a guess is hopeless."""
OwnerT = TypeVar("OwnerT", bound=Hashable)


@dataclass(frozen=True)
class SignInCode(Generic[OwnerT]):
    """One code and its owner."""

    code: str
    """Digits only."""
    owner: OwnerT
    until: float
    """End of its life on the clock of the codes [s]."""


class SignInCodes(Generic[OwnerT]):
    """Codes in memory, each for one use; safe from any thread."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Use a clock [s] that never steps back."""
        self._clock, self._lock = clock, Lock()
        self._codes: dict[str, SignInCode[OwnerT]] = {}

    def create(self, owner: OwnerT) -> SignInCode[OwnerT]:
        """Return a new code; an earlier one of the same owner becomes invalid."""
        with self._lock:
            now = self._clock()
            kept = [one for one in self._codes.values() if one.until > now and one.owner != owner]
            self._codes = {one.code: one for one in kept[1 - _MAX_CODES :]}
            code = f"{secrets.randbelow(10**_DIGITS):0{_DIGITS}}"
            created = self._codes[code] = SignInCode(code, owner, now + CODE_LIFETIME)
            return created

    def redeem(self, code: str) -> OwnerT | None:
        """Return the owner of a code, which is used up; None if it is unknown or too old."""
        with self._lock:
            found = self._codes.pop("".join(filter(str.isdigit, code)), None)
            return found.owner if found is not None and found.until > self._clock() else None

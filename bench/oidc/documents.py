"""Documents of the provider: its addresses (OpenID Connect Discovery) and its keys (RFC 7517)."""

import time
from collections.abc import Callable
from threading import Lock
from typing import Any, cast

from joserfc.errors import JoseError
from joserfc.jwk import KeySet, KeySetSerialization
from pydantic import BaseModel, ValidationError

from bench.oidc.config import Address
from bench.oidc.faults import Fault, SignInError
from bench.oidc.fetching import Fetcher
from bench.validation import describe_validation_error

_PATH = "/.well-known/openid-configuration"
_KEPT_TIME = 3600.0
"""Time for which documents are kept [s]; keys are fetched earlier if one is unknown."""
_FAILURE_TIME = 5.0
"""Time after a failure in which the provider is not asked again [s], so that requests do not pile up."""


class Addresses(BaseModel):
    """Part of the discovery document that a sign-in needs."""

    issuer: str
    authorization_endpoint: Address
    token_endpoint: Address
    jwks_uri: Address
    token_endpoint_auth_methods_supported: tuple[str, ...] = ("client_secret_basic",)


class ProviderDocuments:
    """Addresses and keys, fetched when they are needed; safe from any thread."""

    def __init__(self, issuer: str, fetcher: Fetcher, clock: Callable[[], float] = time.monotonic) -> None:
        """Use a clock [s] that never steps back."""
        self._issuer, self._fetcher, self._clock = issuer, fetcher, clock
        self._lock = Lock()
        self._addresses: Addresses | None = None
        self._keys: KeySet | None = None
        self._fetched, self._keys_fetched = 0.0, 0.0
        self._failure: tuple[float, SignInError] | None = None

    def get_addresses(self) -> Addresses:
        """Return the addresses of the provider.

        Raises:
            SignInError: the provider does not answer as it must.
        """
        with self._lock:
            if self._addresses is None or self._clock() - self._fetched > _KEPT_TIME:
                self._check_failure()
                self._addresses, self._fetched = self._remember_failure(self._fetch_addresses), self._clock()
            return self._addresses

    def get_keys(self, *, renew: bool = False) -> KeySet:
        """Return the keys by which the provider signs; `renew` fetches them again, after a rotation.

        Raises:
            SignInError: the provider does not answer as it must.
        """
        address = self.get_addresses().jwks_uri
        with self._lock:
            if renew or self._keys is None or self._clock() - self._keys_fetched > _KEPT_TIME:
                self._keys, self._keys_fetched = _read_keys(self._fetcher.get(address)), self._clock()
            return self._keys

    def _check_failure(self) -> None:
        if self._failure is not None and self._clock() - self._failure[0] < _FAILURE_TIME:
            raise SignInError(self._failure[1].fault, str(self._failure[1]))

    def _remember_failure(self, fetch: Callable[[], Addresses]) -> Addresses:
        try:
            return fetch()
        except SignInError as error:
            self._failure = self._clock(), error
            raise

    def _fetch_addresses(self) -> Addresses:
        document = self._fetcher.get(self._issuer.rstrip("/") + _PATH)
        try:
            found = Addresses.model_validate(document)
        except ValidationError as error:
            reason = f"discovery document: {describe_validation_error(error)}"
            raise SignInError(Fault.PROVIDER_UNUSABLE, reason) from None
        if found.issuer != self._issuer:
            reason = f"the provider calls itself {found.issuer}, and the configuration {self._issuer}"
            raise SignInError(Fault.PROVIDER_UNUSABLE, reason)
        return found


def _read_keys(document: dict[str, Any]) -> KeySet:
    """Return the keys for signatures; those for encryption do not count."""
    try:
        keys = [key for key in document["keys"] if key.get("use", "sig") == "sig"]
        return KeySet.import_key_set(cast("KeySetSerialization", {"keys": keys}))
    except (JoseError, LookupError, TypeError, ValueError, AttributeError) as error:
        raise SignInError(Fault.PROVIDER_UNUSABLE, f"the provider's keys cannot be read ({error})") from None

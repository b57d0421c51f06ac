"""Requests to the provider, by the standard library."""

import json
import ssl
from collections.abc import Mapping
from http.client import HTTPException
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.parse import urlencode
from urllib.request import HTTPRedirectHandler, HTTPSHandler, Request, build_opener

from bench.errors import ConfigError
from bench.oidc.faults import Fault, SignInError

TIMEOUT = 10.0
"""Time limit of one answer [s]."""
_MAX_SIZE = 1_000_000
"""Largest size of an answer [bytes]."""


class _RefusedRedirect(HTTPRedirectHandler):
    """A redirect could lead secrets to another address."""

    def redirect_request(self, *_: Any, **__: Any) -> None:
        return


class Fetcher:
    """Client for the addresses of one provider; safe from any thread."""

    def __init__(self, certificate: Path | None) -> None:
        """Check the provider by certificates of a file, or by those of the system.

        Raises:
            ConfigError: the file cannot be used.
        """
        try:
            context = ssl.create_default_context(cafile=certificate)
        except (OSError, ssl.SSLError) as error:
            raise ConfigError(f"{certificate}: cannot be used as certificate ({error}); give a PEM file") from None
        self._opener = build_opener(_RefusedRedirect, HTTPSHandler(context=context))

    def get(self, address: str) -> dict[str, Any]:
        """Return the JSON object at an address.

        Raises:
            SignInError: there is no usable answer.
        """
        return self._send(Request(address), Fault.PROVIDER_UNREACHABLE)

    def post(self, address: str, form: Mapping[str, str], headers: Mapping[str, str]) -> dict[str, Any]:
        """Send a form to the token endpoint, and return the JSON object of the answer.

        Raises:
            SignInError: the provider does not answer, or refuses.
        """
        request = Request(address, urlencode(form).encode(), {**headers}, method="POST")
        return self._send(request, Fault.CODE_REFUSED)

    def _send(self, request: Request, refused: Fault) -> dict[str, Any]:
        request.add_header("Accept", "application/json")
        try:
            with self._opener.open(request, timeout=TIMEOUT) as answer:
                return _decode(request.full_url, answer.read(_MAX_SIZE + 1))
        except HTTPError as error:
            with error:
                reason = f"{request.full_url} answered {error.code} {_read_code(error)}"
            raise SignInError(refused if error.code < 500 else Fault.PROVIDER_UNREACHABLE, reason) from None
        except (OSError, HTTPException) as error:
            reason = f"{request.full_url} does not answer ({error})"
            raise SignInError(Fault.PROVIDER_UNREACHABLE, reason) from None


def _decode(address: str, content: bytes) -> dict[str, Any]:
    try:
        found = json.loads(content) if len(content) <= _MAX_SIZE else None
    except ValueError:
        found = None
    if not isinstance(found, dict):
        reason = f"{address} returned no JSON object of at most {_MAX_SIZE} bytes"
        raise SignInError(Fault.PROVIDER_UNUSABLE, reason)
    return found


def _read_code(error: HTTPError) -> str:
    """Return the code of an error (RFC 6749, 5.2), such as ``invalid_grant``."""
    try:
        return str(json.loads(error.read(_MAX_SIZE))["error"])[:80]
    except (OSError, HTTPException, ValueError, KeyError, TypeError):
        return error.reason

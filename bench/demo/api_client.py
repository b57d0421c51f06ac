"""Client of the REST interface, with HTTP and JSON of the standard library only."""

import json
import shutil
from http.client import HTTPException
from pathlib import Path
from typing import Any
from urllib.error import HTTPError, URLError
from urllib.parse import urldefrag
from urllib.request import Request, urlopen

from bench.errors import RunError

_TIMEOUT = 30.0
"""Longest time [s] for one reply."""


class ApiClient:
    """Client of the service at a page's address.

    Args:
        page: ``http://host:port/#token=...``
    """

    def __init__(self, page: str) -> None:
        base, fragment = urldefrag(page)
        self._base = f"{base}api/v1"
        self._token = fragment.removeprefix("token=")

    def get(self, path: str) -> Any:
        """Return the reply to GET.

        Raises:
            RunError: the service refuses or cannot be reached.
        """
        with self._request(path) as reply:
            return json.load(reply)

    def post(self, path: str, content: dict[str, Any]) -> Any:
        """Return the reply to POST.

        Raises:
            RunError: the service refuses or cannot be reached.
        """
        with self._request(path, json.dumps(content).encode()) as reply:
            return json.load(reply)

    def download(self, path: str, to: Path) -> None:
        """Download a file.

        Raises:
            RunError: the service refuses or cannot be reached, or the file cannot be written.
        """
        try:
            with self._request(path) as reply, to.open("wb") as file:
                shutil.copyfileobj(reply, file)
        except OSError as error:
            raise RunError(f"{to}: cannot be written ({error.strerror}); give another --out") from error

    def _request(self, path: str, content: bytes | None = None) -> Any:
        headers = {"Authorization": f"Bearer {self._token}", "Content-Type": "application/json"}
        try:
            return urlopen(Request(self._base + path, content, headers), timeout=_TIMEOUT)
        except HTTPError as error:
            with error:
                raise RunError(f"the service refused {path}: {_read_detail(error)}") from None
        except (URLError, OSError, HTTPException) as error:
            raise RunError(f"the service does not reply to {path}: {error}") from error


def _read_detail(error: HTTPError) -> str:
    """Return the message of a refusal, or its status if the reply is not from the service."""
    try:
        return str(json.load(error)["detail"])
    except (ValueError, KeyError, TypeError):
        return f"HTTP {error.code}; check that the service listens at this address"

"""The service as a script sees it: plain HTTP and JSON, nothing but the standard library."""

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
"""[s] for one answer."""


class Rest:
    """The service behind the page's address.

    Args:
        page: ``http://host:port/#token=...``
    """

    def __init__(self, page: str) -> None:
        base, fragment = urldefrag(page)
        self._base = f"{base}api/v1"
        self._token = fragment.removeprefix("token=")

    def get(self, path: str) -> Any:
        """The answer to GET.

        Raises:
            RunError: the service refuses, or cannot be reached.
        """
        with self._open(path) as answer:
            return json.load(answer)

    def post(self, path: str, content: dict[str, Any]) -> Any:
        """The answer to POST.

        Raises:
            RunError: the service refuses, or cannot be reached.
        """
        with self._open(path, json.dumps(content).encode()) as answer:
            return json.load(answer)

    def download(self, path: str, to: Path) -> None:
        """Bring a file here.

        Raises:
            RunError: the service refuses or cannot be reached, or the file cannot be written.
        """
        try:
            with self._open(path) as answer, to.open("wb") as file:
                shutil.copyfileobj(answer, file)
        except OSError as error:
            raise RunError(f"{to}: cannot be written ({error.strerror}); give another --out") from error

    def _open(self, path: str, content: bytes | None = None) -> Any:
        headers = {"Authorization": f"Bearer {self._token}", "Content-Type": "application/json"}
        try:
            return urlopen(Request(self._base + path, content, headers), timeout=_TIMEOUT)
        except HTTPError as error:
            with error:
                raise RunError(f"the service refuses {path}: {_detail(error)}") from None
        except (URLError, OSError, HTTPException) as error:
            raise RunError(f"the service does not answer {path}: {error}") from error


def _detail(error: HTTPError) -> str:
    """What a refusal says; by its number, where something else than the service has answered."""
    try:
        return str(json.load(error)["detail"])
    except (ValueError, KeyError, TypeError):
        return f"HTTP {error.code}; is it the service that listens there?"

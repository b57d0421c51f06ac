"""HTTP session with the service, by the standard library only."""

import json
import shutil
import ssl
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from http.client import HTTPException
from pathlib import Path
from typing import Any
from urllib.error import HTTPError, URLError
from urllib.parse import quote, urldefrag, urlencode
from urllib.request import Request, urlopen

from websockets.exceptions import WebSocketException
from websockets.sync.client import ClientConnection, connect

from bench.client.errors import ClientError
from bench.client.multipart import Field, MultipartBody
from bench.log import write_atomically

_TIMEOUT = 120.0
"""Longest time [s] for one reply; a comparison, a dry run or a report is made before."""
STOP_TIMEOUT = 10.0
"""Longest time [s] for the reply to a stop, after which a person uses the emergency stop."""
_UPLOAD_TIMEOUT = 600.0
"""Longest time [s] for the reply to an upload, which is imported before."""
_DOWNLOAD_TIMEOUT = 600.0
"""Longest time [s] until a file begins to arrive; a report or an export is made before."""
_CHANNELS_HEADER = "X-Mrbench-Channels"
"""Header of binary samples with name and unit of each channel."""
_TOKEN_FIELD = "token="
"""Name of the token in the address that the service prints."""


class Session:
    """Requests to one service, each with the token.

    Args:
        url: address of the service, such as ``http://127.0.0.1:8600``; it may contain ``#token=...``.
        token: token of the service; by default that of the address.
        certificate: file with the certificate that an ``https`` service must have; by default those of the system.

    Raises:
        ClientError: there is no token, or the file with the certificate cannot be read.
    """

    def __init__(self, url: str, token: str | None = None, certificate: Path | None = None) -> None:
        base, fragment = urldefrag(url)
        self._base = f"{base.rstrip('/')}/api/v1"
        self._token = token or fragment.removeprefix(_TOKEN_FIELD)
        if not self._token:
            raise ClientError(f"{base}: the token is missing; `mrbench serve` prints it at its first start")
        self._tls = None if certificate is None else _make_tls_context(certificate)

    def get(self, path: str, **query: object) -> Any:
        """Return the reply to GET, decoded from JSON; parts of the query that are None are left out.

        Raises:
            ClientError: the service refuses or cannot be reached.
        """
        with self._request("GET", _add_query(path, query)) as reply:
            return _decode(path, reply.read())

    def get_batches(self, path: str, **query: object) -> tuple[bytes, list[dict[str, str]]]:
        """Return binary samples, and the list of their channels from the header of the reply.

        Raises:
            ClientError: the service refuses, cannot be reached, or lists no channels.
        """
        with self._request("GET", _add_query(path, query)) as reply:
            channels: list[dict[str, str]] = _decode(path, reply.headers.get(_CHANNELS_HEADER, "").encode())
            return reply.read(), channels

    def post(
        self,
        path: str,
        content: Mapping[str, Any] | None = None,
        key: str | None = None,
        timeout: float = _TIMEOUT,
    ) -> Any:
        """Return the reply to POST, decoded from JSON.

        Args:
            path: path below ``/api/v1``.
            content: body of the request.
            key: idempotency key; a repeated request with the same key has no further effect, and one whose
                answer was lost is repeated here, once.
            timeout: longest time for the reply [s].

        Raises:
            ClientError: the service refuses or cannot be reached.
        """
        body = b"" if content is None else json.dumps(content).encode()
        return self._send("POST", path, body, key, timeout=timeout)

    def upload(self, path: str, fields: Sequence[Field], key: str) -> Any:
        """Return the reply to POST of fields and files, decoded from JSON.

        Args:
            path: path below ``/api/v1``.
            fields: names with texts or files.
            key: idempotency key, as for `post`.

        Raises:
            ClientError: a file cannot be read, or the service refuses or cannot be reached.
        """
        body = MultipartBody(fields)
        return self._send("POST", path, body, key, body.headers, _UPLOAD_TIMEOUT)

    def patch(self, path: str, content: Mapping[str, Any], key: str | None = None) -> Any:
        """Return the reply to PATCH, decoded from JSON; path, content and key as for `post`.

        Raises:
            ClientError: the service refuses or cannot be reached.
        """
        return self._send("PATCH", path, json.dumps(content).encode(), key)

    def delete(self, path: str, **query: object) -> Any:
        """Return the reply to DELETE, decoded from JSON; parts of the query that are None are left out.

        Raises:
            ClientError: the service refuses or cannot be reached.
        """
        return self._send("DELETE", _add_query(path, query), b"", None)

    def download(self, path: str, to: Path) -> Path:
        """Download a file, which appears complete or not at all, and return its path.

        Raises:
            ClientError: the service refuses or cannot be reached, or the download breaks off.
            LogError: the file cannot be written.
        """
        with write_atomically(to) as partial, self._request("GET", path, timeout=_DOWNLOAD_TIMEOUT) as reply:
            try:
                with partial.open("wb") as file:
                    shutil.copyfileobj(reply, file)
            except (OSError, HTTPException) as error:
                raise ClientError(f"{to}: the download of {path} failed ({error}); repeat it") from error
            received, announced = partial.stat().st_size, reply.headers["Content-Length"]
            if announced is not None and received != int(announced):
                raise ClientError(f"{to}: {received} of {announced} bytes of {path} arrived; repeat the download")
        return to

    def _send(
        self,
        method: str,
        path: str,
        body: Iterable[bytes] | bytes,
        key: str | None,
        headers: Mapping[str, str] | None = None,
        timeout: float = _TIMEOUT,
    ) -> Any:
        given = {**(headers or {}), **({} if key is None else {"Idempotency-Key": key})}
        try:
            return self._send_once(method, path, body, given, timeout)
        except ClientError as error:
            if key is None or error.status is not None:
                raise
            return self._send_once(method, path, body, given, timeout)

    def _send_once(
        self, method: str, path: str, body: Iterable[bytes] | bytes, headers: Mapping[str, str], timeout: float
    ) -> Any:
        with self._request(method, path, body, headers, timeout) as reply:
            try:
                content: bytes = reply.read()
            except (OSError, HTTPException) as error:
                raise ClientError(f"the answer to {path} broke off ({error}); repeat it") from error
        return _decode(path, content)

    @contextmanager
    def connect(self, path: str, wishes: Mapping[str, Any]) -> Iterator[ClientConnection]:
        """Open a websocket for the duration of a block, and sign in with its first message.

        Args:
            path: path below ``/api/v1``.
            wishes: further fields of the first message.

        Raises:
            ClientError: the service cannot be reached, or the connection ends.
        """
        address = f"ws{self._base.removeprefix('http')}{path}"
        tls = self._tls if address.startswith("wss:") else None
        try:
            with connect(address, ssl=tls, max_size=None) as socket:
                socket.send(json.dumps({"token": self._token, **wishes}))
                yield socket
        except (OSError, WebSocketException) as error:
            reason = str(error) or "it is silent"
            raise ClientError(f"the service at {self._base} does not reply to {path}: {reason}") from error

    def _request(
        self,
        method: str,
        path: str,
        content: Iterable[bytes] | bytes | None = None,
        headers: Mapping[str, str] | None = None,
        timeout: float = _TIMEOUT,
    ) -> Any:
        given = {"Authorization": f"Bearer {self._token}", "Content-Type": "application/json", **(headers or {})}
        request = Request(self._base + path, content, given, method=method)
        try:
            return urlopen(request, timeout=timeout, context=self._tls)
        except HTTPError as error:
            with error:
                raise _make_refusal(path, error) from None
        except (URLError, OSError, HTTPException) as error:
            raise ClientError(f"the service at {self._base} does not reply to {path}: {error}") from error


def _add_query(path: str, query: Mapping[str, object]) -> str:
    """Return a path with the parts of a query that are not None; a sequence gives several parts of one name."""
    given = {name: value for name, value in query.items() if value is not None}
    return f"{path}?{urlencode(given, doseq=True)}" if given else path


def quote_name(name: str) -> str:
    """Return a name as one component of a path."""
    return quote(name, safe="")


def _make_tls_context(certificate: Path) -> ssl.SSLContext:
    try:
        return ssl.create_default_context(cafile=certificate)
    except (OSError, ssl.SSLError) as error:
        raise ClientError(f"{certificate}: not a readable certificate ({error}); give a PEM file") from error


def _decode(path: str, reply: bytes) -> Any:
    try:
        return json.loads(reply)
    except ValueError as error:
        raise ClientError(f"the reply to {path} is not JSON; check that the service listens there") from error


def _make_refusal(path: str, error: HTTPError) -> ClientError:
    """Return the error for a refusal: its problem, or its status if the reply is not from the service."""
    try:
        problem = json.load(error)
        return ClientError(f"the service refused {path}: {problem['detail']}", error.code, problem["type"])
    except (ValueError, KeyError, TypeError):
        hint = "check that the service listens at this address"
        return ClientError(f"the service refused {path}: HTTP {error.code}; {hint}", error.code)

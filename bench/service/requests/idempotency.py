"""Idempotency keys: a repeated request returns the stored answer of the first one, and starts nothing again.

A route takes keys by ``dependencies=[IDEMPOTENT]`` on a router with ``route_class=IdempotentRoute``. Routes that
stop something take none: a stop must act each time.

A key is claimed in the catalogue before its request is handled, and the answer is stored afterwards. A request
that was interrupted between both, or refused, is handled again when it is repeated. A route that starts something
then looks for what the first request started: its time is `find_first_request`.
"""

import asyncio
import hashlib
import logging
import re
from collections.abc import Callable, Coroutine
from datetime import UTC, datetime
from http import HTTPStatus
from typing import Annotated, Any
from weakref import WeakValueDictionary

from fastapi import Depends, Header, Request, Response
from fastapi.routing import APIRoute

from bench.catalogue import CatalogueUnavailableError, ClaimedKey, IdempotencyKeys
from bench.service.context import ServiceContext
from bench.service.problems import ProblemError, shorten

Handler = Callable[[Request], Coroutine[Any, Any, Response]]

_HEADER = "Idempotency-Key"
_PATTERN = re.compile(r"[!-~]{1,255}")
_KEPT_HEADERS = ("location", "etag")
"""Headers of an answer that are stored with it."""
_CHUNK = 1 << 20
"""Number of bytes of an upload that are read at once."""
_LOG = logging.getLogger(__name__)


def _describe_key(
    idempotency_key: Annotated[
        str | None,
        Header(
            description="text that a client chooses for one request, such as a UUID; a repetition with the same "
            "body returns the stored answer, for a day"
        ),
    ] = None,
) -> None:
    """Describe the header for OpenAPI; `IdempotentRoute` reads it."""


IDEMPOTENT = Depends(_describe_key)
"""Dependency by which a route declares that it takes idempotency keys."""


class IdempotentRoute(APIRoute):
    """Route that answers a repeated request with the stored answer, if it is declared `IDEMPOTENT`."""

    def get_route_handler(self) -> Handler:
        """Return the handler of the route, within the check of the key."""
        handle = super().get_route_handler()
        if not any(one.dependency is _describe_key for one in self.dependencies):
            return handle

        async def handle_once(request: Request) -> Response:
            key = request.headers.get(_HEADER)
            return await (handle(request) if key is None else _handle_with_key(handle, request, key))

        return handle_once


def find_first_request(request: Request) -> datetime | None:
    """Return the time [UTC] at which the key of a request was first used; None without a key.

    It is the same for every repetition, also after the service was restarted.
    """
    first: datetime | None = getattr(request.state, "first_request", None)
    return first


async def _handle_with_key(handle: Handler, request: Request, key: str) -> Response:
    if not _PATTERN.fullmatch(key):
        raise _refuse(
            f"{_HEADER} has {len(key)} characters; give 1 to 255 visible ASCII characters, without spaces"
        )
    context: ServiceContext = request.app.state.context
    # Two simultaneous requests with one key: the second waits for the answer of the first.
    locks: WeakValueDictionary[str, asyncio.Lock] = context.key_locks
    lock = locks.setdefault(key, asyncio.Lock())
    try:
        async with lock:
            return await _handle_alone(handle, request, key, context.catalogue.idempotency_keys)
    finally:
        await request.close()  # the files of a form that no handler has read


async def _handle_alone(handle: Handler, request: Request, key: str, keys: IdempotencyKeys) -> Response:
    operation = f"{request.method} {request.url.path}?{request.url.query}"
    fingerprint = await _compute_fingerprint(request)
    claimed = await asyncio.to_thread(keys.claim, key, operation, fingerprint, datetime.now(UTC))
    if claimed.operation != operation:
        raise _refuse(f"{_HEADER} {shorten(key)} belongs to {shorten(claimed.operation)}; use a new key")
    if claimed.fingerprint != fingerprint:
        raise _refuse(f"{_HEADER} {shorten(key)} was used with another body; use a new key for another request")
    if claimed.status is not None:
        return _restore(claimed)
    request.state.first_request = claimed.created
    response = await handle(request)
    await asyncio.to_thread(_store, keys, key, response)
    return response


async def _compute_fingerprint(request: Request) -> str:
    """Compute the SHA-256 of a body; of a form that of its parts, because their boundary is chosen at random.

    The handler reads the same body afterwards, which the framework keeps.
    """
    digest = hashlib.sha256()
    if not request.headers.get("content-type", "").startswith("multipart/"):
        digest.update(await request.body())
        return digest.hexdigest()
    for name, part in (await request.form()).multi_items():
        digest.update(f"{name}={part if isinstance(part, str) else part.filename}\n".encode())
        if not isinstance(part, str):
            while chunk := await part.read(_CHUNK):
                digest.update(chunk)
            await part.seek(0)
    return digest.hexdigest()


def _restore(claimed: ClaimedKey) -> Response:
    headers = {**claimed.headers, "Idempotency-Replayed": "true"}
    return Response(claimed.answer, claimed.status or HTTPStatus.OK, headers, "application/json")


def _store(keys: IdempotencyKeys, key: str, response: Response) -> None:
    """Store an answer; if that fails, a repetition is handled like one after an interruption."""
    headers = {name: response.headers[name] for name in _KEPT_HEADERS if name in response.headers}
    try:
        keys.store(key, response.status_code, headers, bytes(response.body).decode())
    except CatalogueUnavailableError as error:
        _LOG.warning("answer_not_stored", extra={"why": str(error)})


def _refuse(detail: str) -> ProblemError:
    title = "The idempotency key cannot be used"
    return ProblemError(HTTPStatus.UNPROCESSABLE_ENTITY, "idempotency-key-refused", title, detail)

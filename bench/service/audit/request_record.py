"""Record of one request while it is handled: its body, the former value, and its answer."""

import asyncio
import hashlib
import json
import uuid
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from http import HTTPStatus
from typing import Any
from urllib.parse import unquote

from starlette.datastructures import Headers
from starlette.routing import BaseRoute, Match
from starlette.types import Message, Scope

from bench.agent_protocol import Sender, send_as
from bench.audit import Act, redact
from bench.service.audit.trail import UNKNOWN

_BENCH = "bench"
"""Actor of a request with the token of the bench."""
_SMALL = 1 << 16
"""Size up to which a body is parsed in the event loop [bytes]."""
_MAX_ANSWER = 1 << 14
"""Size up to which the answer to a refused request is read [bytes]."""
_CURRENT: ContextVar["RequestRecord | None"] = ContextVar("audited_request", default=None)


def note_old(value: Any) -> None:
    """Hand over the value that the present request changes, before it is changed; without effect outside one."""
    record = _CURRENT.get()
    if record is not None:
        record.old = redact(value)


class RequestRecord:
    """Record of one request."""

    def __init__(self, scope: Scope, api: str, routes: Sequence[BaseRoute]) -> None:
        """Begin the record of a request.

        Args:
            scope: the request.
            api: start of all paths of the interface.
            routes: routes of the interface, whose paths do not contain that start.
        """
        self._scope, self._api = scope, api
        # Now, because a request that is refused before its route is found must have one, too.
        self._path, self._target = _find_route(scope, scope["path"].removeprefix(api), routes)
        self._id = uuid.uuid4().hex[:16]
        self._act = Act(actor=UNKNOWN, action="")  # of the present time
        self._headers = Headers(scope=scope)
        self._is_json = "json" in self._headers.get("content-type", "")
        self._body: list[bytes] = []
        self._size = 0
        self._answer: list[bytes] = []
        self._answer_headers = Headers()
        self._status = int(HTTPStatus.INTERNAL_SERVER_ERROR)
        self.old: Any = None

    @contextmanager
    def as_current(self) -> Iterator[None]:
        """Receive the old values of a block, and send its commands to the agent on behalf of the actor."""
        token = _CURRENT.set(self)
        try:
            with send_as(self._make_sender):
                yield
        finally:
            _CURRENT.reset(token)

    def take_body(self, message: Message) -> None:
        """Take a part of the body."""
        body = message.get("body", b"")
        self._size += len(body)
        if self._is_json and body:
            self._body.append(body)

    def take_answer(self, message: Message) -> None:
        """Take a part of the answer."""
        if message["type"] == "http.response.start":
            self._status = message["status"]
            self._answer_headers = Headers(raw=message["headers"])
        elif self._status >= HTTPStatus.BAD_REQUEST and sum(map(len, self._answer)) < _MAX_ANSWER:
            self._answer.append(message.get("body", b""))

    async def make_act(self) -> Act:
        """Return the finished record."""
        new = await asyncio.to_thread(self._read_body) if self._size > _SMALL else self._read_body()
        return self._act.model_copy(
            update={
                "actor": self._find_actor(),
                "origin": self._find_origin(),
                "request": self._id,
                "action": f"{self._scope['method']} {_clean(self._path)}",
                "target": _clean(self._target or self._find_created()),
                "old": self.old,
                "new": new,
                "outcome": self._describe_outcome(),
            }
        )

    def _make_sender(self) -> Sender:
        return Sender(actor=self._find_actor()[:300], origin=self._find_origin()[:300], request=self._id)

    def _find_actor(self) -> str:
        actor = self._scope.get("state", {}).get("actor", "")
        return str(actor) or (UNKNOWN if self._status == HTTPStatus.UNAUTHORIZED else _BENCH)

    def _find_origin(self) -> str:
        client = self._scope.get("client")
        return client[0] if client else ""

    def _find_created(self) -> str:
        """Return the id of what was created, from the header of the answer."""
        location = unquote(self._answer_headers.get("location", ""))
        return location.removeprefix(f"{self._api}/").partition("/")[2]

    def _read_body(self) -> Any:
        if self._size == 0:
            return None
        if not self._is_json:
            kind = self._headers.get("content-type", "").partition(";")[0]
            return {"content_type": redact(kind), "bytes": self._size}
        body = b"".join(self._body)
        try:
            return redact(json.loads(body))
        except (ValueError, RecursionError):
            return {"invalid": True, "bytes": len(body), "sha256": hashlib.sha256(body).hexdigest()}

    def _describe_outcome(self) -> str:
        """Return the status, with the reason of a refusal, or the note that an answer was repeated."""
        if "idempotency-replayed" in self._answer_headers:
            return f"{self._status} answer repeated, nothing was done"
        try:
            detail = json.loads(b"".join(self._answer))["detail"] if self._answer else ""
        except (ValueError, TypeError, KeyError):
            detail = ""
        return f"{self._status} {redact(str(detail))}".strip()


def _find_route(scope: Scope, path: str, routes: Sequence[BaseRoute]) -> tuple[str, str]:
    """Return the path template and the ids in a path; the path itself without a route for it."""
    below = {**scope, "path": path, "root_path": ""}
    for route in routes:
        match, found = route.matches(below)
        if match is Match.FULL:
            template = getattr(route, "path", path).replace(":path}", "}")
            return template, "/".join(map(str, found.get("path_params", {}).values()))
    return path, ""


def _clean(text: str) -> str:
    """Return a text from a request as an entry can hold it."""
    return str(redact(text))

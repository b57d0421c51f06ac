"""Files as answers, of fixed length also while they grow."""

from http import HTTPStatus
from pathlib import Path
from typing import Any

from fastapi.responses import FileResponse
from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import Message, Receive, Scope, Send

from bench.service.requests import NOT_MODIFIED, is_known, make_not_modified


class SnapshotResponse(FileResponse):
    """File as long as it is now, or a range of it.

    A plain file response announces the present length and then sends all that was appended meanwhile.
    """

    def __init__(self, path: Path, media_type: str, filename: str, *, inline: bool = False) -> None:
        """Take the present length of a file.

        Args:
            path: the file.
            media_type: of its content.
            filename: name under which it is saved.
            inline: shown by a browser instead of saved.
        """
        disposition = "inline" if inline else "attachment"
        super().__init__(
            path,
            media_type=media_type,
            filename=filename,
            stat_result=path.stat(),
            content_disposition_type=disposition,
        )

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the announced number of bytes, and no more; 304 to a client that has this content already.

        Raises:
            HTTPException: the requested range is invalid, or outside the file.
        """
        tag = self.headers["etag"]
        if is_known(Headers(scope=scope).get("if-none-match"), tag):
            await make_not_modified(tag)(scope, receive, send)
            return
        await super().__call__(scope, receive, _limit_length(send))


def describe_file(*media_types: str) -> dict[int | str, dict[str, Any]]:
    """Describe a file as the answer of a route, for OpenAPI."""
    content: dict[str, Any] = {media_type: {} for media_type in media_types}
    return {HTTPStatus.OK: {"description": "the file", "content": content}, **NOT_MODIFIED}


def _limit_length(send: Send) -> Send:
    remaining = 0

    async def send_limited(message: Message) -> None:
        nonlocal remaining
        if message["type"] == "http.response.start":
            headers = Headers(raw=message["headers"])
            _check_range(message["status"], headers)
            remaining = int(headers["content-length"])
        elif message["type"] == "http.response.body" and "body" in message:
            body = message["body"][:remaining]
            remaining -= len(body)
            message = {**message, "body": body}
        await send(message)

    return send_limited


def _check_range(status: int, headers: Headers) -> None:
    """Raise the refusal of a range, which the framework answers as plain text."""
    if status == HTTPStatus.BAD_REQUEST:
        raise HTTPException(status, "the header Range is not of the form bytes=FIRST-LAST")
    if status == HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE:
        size = headers["content-range"]
        raise HTTPException(status, f"the range is outside the file ({size})", {"Content-Range": size})

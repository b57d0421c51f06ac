"""Websocket with live messages."""

import asyncio

from fastapi import APIRouter, WebSocket, WebSocketDisconnect
from pydantic import BaseModel, ValidationError

from bench.service.context import Context
from bench.service.live import SubscriberQueue

router = APIRouter()
_CLOSE_UNAUTHORISED = 4401
"""Close code for a token that is missing or wrong."""
_SIGN_IN_TIMEOUT = 10.0
"""Longest time until the first message, which carries the token [s]."""


class SignIn(BaseModel):
    """First message of a client."""

    token: str


@router.websocket("/live")
async def stream_live(websocket: WebSocket, context: Context) -> None:
    """Send messages `{"topic": ..., "data": ...}`: clock, status, samples, event, job and run.

    The first message of the client is `{"token": ...}`. An address would appear in the logs of proxies.
    """
    # Accepted before the token is checked: a browser receives the close code only of an open connection.
    await websocket.accept()
    if not context.access.is_allowed(await _receive_token(websocket)):
        await websocket.close(_CLOSE_UNAUTHORISED, "the first message has no valid token")
        return
    with context.live.subscribe() as queue:
        sender = asyncio.create_task(_send(websocket, queue))
        try:
            while True:
                await websocket.receive_text()
        except (WebSocketDisconnect, KeyError):
            # The client has disconnected, or has sent bytes instead of text: the connection ends.
            pass
        finally:
            sender.cancel()


async def _receive_token(websocket: WebSocket) -> str:
    """Return the token in the first message; empty without one."""
    try:
        async with asyncio.timeout(_SIGN_IN_TIMEOUT):
            return SignIn.model_validate_json(await websocket.receive_text()).token
    except (TimeoutError, ValidationError, WebSocketDisconnect, KeyError):
        return ""


async def _send(websocket: WebSocket, queue: SubscriberQueue) -> None:
    try:
        while True:
            for text in await queue.take():
                await websocket.send_text(text)
    except (WebSocketDisconnect, RuntimeError):
        # The client has disconnected during a transmission; the receiving task ends the connection.
        return

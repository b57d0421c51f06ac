"""Websocket with live messages."""

import asyncio

from fastapi import APIRouter, WebSocket, WebSocketDisconnect

from bench.service.context import Context
from bench.service.live import SubscriberQueue

router = APIRouter()
_CLOSE_UNAUTHORISED = 4401
"""Close code for a token that is missing or wrong."""


@router.websocket("/live")
async def stream_live(websocket: WebSocket, context: Context, token: str = "") -> None:
    """Send messages `{"topic": ..., "data": ...}` with the topics status, samples, event, job and run."""
    # Accepted before the token is checked: a browser receives the close code only of an open connection.
    await websocket.accept()
    if not context.access.is_allowed(token):
        await websocket.close(_CLOSE_UNAUTHORISED, "the token is missing or wrong")
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


async def _send(websocket: WebSocket, queue: SubscriberQueue) -> None:
    try:
        while True:
            for text in await queue.take():
                await websocket.send_text(text)
    except (WebSocketDisconnect, RuntimeError):
        # The client has disconnected during a transmission; the receiving task ends the connection.
        return

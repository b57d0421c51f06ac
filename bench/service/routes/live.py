"""The websocket that tells what happens as it happens."""

import asyncio

from fastapi import APIRouter, WebSocket, WebSocketDisconnect

from bench.service.context import Context
from bench.service.live import SubscriberQueue

router = APIRouter()
_CLOSE_UNAUTHORISED = 4401
"""Close code for a token that is missing or wrong."""


@router.websocket("/live")
async def stream_live(websocket: WebSocket, context: Context, token: str = "") -> None:
    """Messages `{"topic": ..., "data": ...}` of status, samples, event, job and run, until either side ends it."""
    # Before the token is looked at: a browser is told the code only of a connection that was open.
    await websocket.accept()
    if not context.access.is_allowed(token):
        await websocket.close(_CLOSE_UNAUTHORISED, "the token is missing or wrong")
        return
    with context.live.subscribe() as mailbox:
        sending = asyncio.create_task(_send(websocket, mailbox))
        try:
            while True:
                await websocket.receive_text()
        except (WebSocketDisconnect, KeyError):
            # It has gone, or sends bytes where words are expected: either way, this is its end.
            pass
        finally:
            sending.cancel()


async def _send(websocket: WebSocket, mailbox: SubscriberQueue) -> None:
    try:
        while True:
            for text in await mailbox.take():
                await websocket.send_text(text)
    except (WebSocketDisconnect, RuntimeError):
        # Gone while something was on its way; the receiving side sees it, too, and ends this.
        return

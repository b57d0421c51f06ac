"""Websocket with live messages and samples."""

import asyncio
from contextlib import suppress

from fastapi import APIRouter, WebSocket, WebSocketDisconnect
from pydantic import BaseModel, Field, ValidationError

from bench.live import Listener, ListenerSettings
from bench.service.context import Context

router = APIRouter()
_CLOSE_UNAUTHORISED = 4401
"""Close code for a token that is missing or wrong."""
_SIGN_IN_TIMEOUT = 10.0
"""Longest time until the first message, which carries the token [s]."""


class SignIn(BaseModel):
    """First message of a client."""

    token: str
    rate_hz: float = Field(default=float("inf"), gt=0, description="largest rate of the samples [Hz]")
    acknowledge: bool = Field(default=False, description="whether the client acknowledges the batches")


class Acknowledgement(BaseModel):
    """Further message of a client: the sequence number of a batch that it has handled."""

    received: int


@router.websocket("/live")
async def stream_live(websocket: WebSocket, context: Context) -> None:
    """Send messages `{"topic": ..., "data": ...}` and samples in binary live batches.

    The first message of the client is `{"token": ...}`. An address would appear in the logs of proxies. A client
    that acknowledges the batches gets fresh ones when it resumes, instead of those in the buffers of the network.
    """
    # Accepted before the token is checked: a browser receives the close code only of an open connection.
    await websocket.accept()
    sign_in = await _receive_sign_in(websocket)
    if not context.access.is_allowed(sign_in.token):
        await websocket.close(_CLOSE_UNAUTHORISED, "the first message has no valid token")
        return
    with context.live.listen(ListenerSettings(sign_in.rate_hz, sign_in.acknowledge)) as listener:
        sender = asyncio.create_task(_send(websocket, listener))
        try:
            while True:
                _handle_message(listener, await websocket.receive_text())
        except (WebSocketDisconnect, KeyError):
            # The client has disconnected, or has sent bytes instead of text: the connection ends.
            pass
        finally:
            sender.cancel()


async def _receive_sign_in(websocket: WebSocket) -> SignIn:
    """Return the first message; without a token if there is none."""
    try:
        async with asyncio.timeout(_SIGN_IN_TIMEOUT):
            return SignIn.model_validate_json(await websocket.receive_text())
    except (TimeoutError, ValidationError, WebSocketDisconnect, KeyError):
        return SignIn(token="")


def _handle_message(listener: Listener, text: str) -> None:
    with suppress(ValidationError):  # what a newer client may send is ignored
        listener.acknowledge(Acknowledgement.model_validate_json(text).received)


async def _send(websocket: WebSocket, listener: Listener) -> None:
    try:
        while True:
            for message in await listener.take():
                if isinstance(message, bytes):
                    await websocket.send_bytes(message)
                else:
                    await websocket.send_text(message)
    except (WebSocketDisconnect, RuntimeError):
        # The client has disconnected during a transmission; the receiving task ends the connection.
        return

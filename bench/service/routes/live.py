"""Websocket with live messages and samples."""

import asyncio
import hmac
from collections.abc import Awaitable, Callable
from contextlib import suppress

from fastapi import APIRouter, WebSocket, WebSocketDisconnect
from pydantic import BaseModel, Field, ValidationError

from bench.catalogue import CatalogueUnavailableError
from bench.live import Listener, ListenerSettings
from bench.service.access import CredentialKind, compute_csrf, read_cookie
from bench.service.benches import ServedBenches
from bench.service.context import Context, ServiceContext

router = APIRouter()
_CLOSE_UNAUTHORISED = 4401
"""Close code for a sign-in that is missing, wrong, or has ended."""
_CLOSE_UNKNOWN = 4404
"""Close code for a bench that the service does not have, or for several benches of which none is named."""
_MAX_REASON = 123
"""Longest reason with which a websocket can be closed [bytes]."""
_CHECK_INTERVAL = 10.0
"""Time after which it is checked again whether a client is signed in [s]."""
_SIGN_IN_TIMEOUT = 10.0
"""Longest time until the first message, which carries the sign-in [s]."""


class SignIn(BaseModel):
    """First message of a client: a token, or the CSRF value of its session."""

    token: str | None = None
    csrf: str | None = Field(default=None, description="value of the session whose cookie came with the handshake")
    rate_hz: float = Field(default=float("inf"), gt=0, description="largest rate of the samples [Hz]")
    bench: str | None = Field(default=None, description="name of the bench; needed if there are several")
    acknowledge: bool = Field(default=False, description="whether the client acknowledges the batches")


class Acknowledgement(BaseModel):
    """Further message of a client: the sequence number of a batch that it has handled."""

    received: int


@router.websocket("/live")
async def stream_live(websocket: WebSocket, context: Context) -> None:
    """Send messages `{"topic": ..., "data": ...}` and samples in binary live batches.

    The first message of the client is `{"token": ...}`, or `{"csrf": ...}` of the session whose cookie came with
    the handshake. An address would appear in the logs of proxies. With several benches, `bench` in the same
    message names one. A client that acknowledges the batches gets fresh ones when it resumes, instead of those in
    the buffers of the network.
    """
    # Accepted before the token is checked: a browser receives the close code only of an open connection.
    await websocket.accept()
    sign_in = await _receive_sign_in(websocket)
    identify = _make_check(websocket, sign_in, context)
    if not await identify():
        await websocket.close(_CLOSE_UNAUTHORISED, "the first message has no valid token or session")
        return
    bench = context.benches.find(sign_in.bench)
    if bench is None:
        await websocket.close(_CLOSE_UNKNOWN, _describe_unknown(context.benches))
        return
    with bench.live.listen(ListenerSettings(sign_in.rate_hz, sign_in.acknowledge)) as listener:
        sender = asyncio.create_task(_send(websocket, listener))
        guard = asyncio.create_task(_close_after_sign_out(websocket, identify))
        try:
            while True:
                _handle_message(listener, await websocket.receive_text())
        except (WebSocketDisconnect, KeyError):
            # The client has disconnected, or has sent bytes instead of text: the connection ends.
            pass
        finally:
            sender.cancel()
            guard.cancel()


def _describe_unknown(benches: ServedBenches) -> str:
    return f"name the bench in the first message: {', '.join(benches.names)}"[:_MAX_REASON]


def _make_check(websocket: WebSocket, sign_in: SignIn, context: ServiceContext) -> Callable[[], Awaitable[bool]]:
    """Return the check whether a client is signed in, which holds for later times, too."""
    secret = read_cookie(websocket.scope)
    if sign_in.token is not None:
        credential: tuple[CredentialKind, str] = ("token", sign_in.token)
    elif secret is not None and hmac.compare_digest((sign_in.csrf or "").encode(), compute_csrf(secret).encode()):
        credential = ("session", secret)
    else:
        credential = ("token", "")

    async def is_signed_in() -> bool:
        try:
            return await asyncio.to_thread(context.authenticator.identify, *credential) is not None
        except CatalogueUnavailableError:  # who was signed in stays so
            return context.authenticator.recall_for_stop(*credential) is not None

    return is_signed_in


async def _close_after_sign_out(websocket: WebSocket, is_signed_in: Callable[[], Awaitable[bool]]) -> None:
    """Close the connection once its token or session has ended."""
    while await is_signed_in():  # noqa: ASYNC110 - other processes end sessions, too
        await asyncio.sleep(_CHECK_INTERVAL)
    await websocket.close(_CLOSE_UNAUTHORISED, "the session has ended; sign in again")


async def _receive_sign_in(websocket: WebSocket) -> SignIn:
    """Return the first message; without a token if there is none."""
    try:
        async with asyncio.timeout(_SIGN_IN_TIMEOUT):
            return SignIn.model_validate_json(await websocket.receive_text())
    except (TimeoutError, ValidationError, WebSocketDisconnect, KeyError):
        return SignIn()


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

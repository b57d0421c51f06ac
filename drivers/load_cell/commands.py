"""Requests to the load cell and their replies, between the samples of the running stream."""

import itertools
import threading
import time
from collections.abc import Callable
from typing import Final

from drivers.errors import InvalidReplyError, NoReplyError, RefusedError
from drivers.load_cell.decoder import LoadCellDecoder
from drivers.load_cell.frames import CONTRACT, Acknowledgement, Identity, Reply, Request, encode_frame

_COMMANDS: Final[dict[str, int]] = CONTRACT["commands"]
_DEADLINES = CONTRACT["deadlines"]
_CODES = {code: name.replace("_", " ") for name, code in CONTRACT["codes"].items()}
_HINTS = {
    "tare": "; the reading must be steady and in range: hold the actuator still",
    "set_rate": "; stop the stream first",
    "shunt": "; a command can switch the shunt only in a load cell that has one, see its manual",
}
WAIT_SLICE = 0.01
"""Time that a thread waits before it checks whether the other thread has read its reply [s]."""


class CommandChannel:
    """Requests of any thread, one at a time."""

    def __init__(
        self,
        name: str,
        decoder: LoadCellDecoder,
        write: Callable[[bytes], None],
        read: Callable[[float], None],
    ) -> None:
        """Prepare; nothing is sent yet.

        Args:
            name: name of the instrument, for messages.
            decoder: decoder of the received bytes, which collects the replies.
            write: function that sends bytes.
            read: function that reads the line once into the decoder, or waits as long [s] for another thread that
                is reading it.
        """
        self._name, self._decoder, self._write, self._read = name, decoder, write, read
        self._tokens = itertools.count()
        self._lock = threading.Lock()

    def make_token(self) -> int:
        """Return a token that the last 255 requests did not carry."""
        return next(self._tokens) % 256

    def identify(self) -> int:
        """Check that a load cell of the wire file's protocol and calibration replies.

        Returns:
            Its serial number.

        Raises:
            NoReplyError, InvalidReplyError: another instrument replied, or none.
        """
        reply = self._send_request("identify")
        if not isinstance(reply, Identity):
            raise self._make_wrong_reply_error("identify", reply)
        for quantity in ("protocol", "counts_per_newton"):
            value, expected = getattr(reply, quantity), CONTRACT["instrument"][quantity]
            if value != expected:
                raise InvalidReplyError(
                    f"{self._name}: it reports {quantity} {value}, expected {expected}; set it in the instrument, "
                    "or correct the wire file"
                )
        return reply.serial

    def execute(self, command: str, argument: int = 0) -> int:
        """Send a command and return the value of its acknowledgement.

        Raises:
            NoReplyError, InvalidReplyError, RefusedError: it was not acknowledged.
        """
        reply = self._send_request(command, argument)
        if not isinstance(reply, Acknowledgement):
            raise self._make_wrong_reply_error(command, reply)
        if reply.code:
            reason = _CODES.get(reply.code, f"code {reply.code}")
            raise RefusedError(
                f"{self._name}: {command} {argument or ''} refused: {reason}{_HINTS.get(command, '')}"
            )
        return reply.value

    def _make_wrong_reply_error(self, command: str, reply: Reply) -> InvalidReplyError:
        return InvalidReplyError(
            f"{self._name}: {command} received the reply {reply}; check that this is the load cell"
        )

    def _send_request(self, command: str, argument: int = 0) -> Reply:
        """Send a request until it is answered; its token identifies the reply."""
        with self._lock:
            request = Request(self.make_token(), _COMMANDS[command], argument)
            # Tokens repeat: the reply to the request 256 before must not be taken for this one's.
            self._decoder.replies.pop(request.token, None)
            # Every attempt carries the same token: a late reply to the first is as good as one to the last.
            for _ in range(_DEADLINES["attempts"]):
                self._write(encode_frame(request))
                if (reply := self._wait_for_reply(request)) is not None:
                    return reply
        raise NoReplyError(
            f"{self._name}: {command} received no reply within {_DEADLINES['reply_s']:.3g} s, "
            f"sent {_DEADLINES['attempts']} times; check power, cable and baud rate"
        )

    def _wait_for_reply(self, request: Request) -> Reply | None:
        deadline = time.monotonic() + _DEADLINES["reply_s"]
        while time.monotonic() < deadline:
            self._read(WAIT_SLICE)
            reply = self._decoder.replies.get(request.token)
            if reply is not None and reply.command == request.command:
                return reply
        return None

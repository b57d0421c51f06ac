"""Questions to the load cell and their answers, between the samples that never cease."""

import itertools
import threading
import time
from collections.abc import Callable
from typing import Final

from drivers.errors import BadReply, NoReply, Refused
from drivers.load_cell_frames import CONTRACT, Acknowledgement, Answer, Identity, Request, encode
from drivers.load_cell_stream import SampleStream

_COMMANDS: Final[dict[str, int]] = CONTRACT["commands"]
_DEADLINES = CONTRACT["deadlines"]
_CODES = {code: name.replace("_", " ") for name, code in CONTRACT["codes"].items()}
_HINTS = {
    "tare": "; the reading must be steady and in range: hold the actuator still",
    "set_rate": "; stop the stream first",
}
SLICE = 0.01
"""[s] that one thread waits before it looks whether the other has read its answer."""


class Dialogue:
    """One question at a time, from any thread."""

    def __init__(
        self,
        name: str,
        stream: SampleStream,
        write: Callable[[bytes], None],
        read: Callable[[float], None],
    ) -> None:
        """Nothing has been asked yet.

        Args:
            name: of the instrument, for messages.
            stream: takes what the instrument sends, its answers among it.
            write: sends bytes.
            read: reads the line once into the stream, or waits as long [s] for whoever is reading it.
        """
        self._name, self._stream, self._write, self._read = name, stream, write, read
        self._tokens = itertools.count()
        self._asking = threading.Lock()

    def token(self) -> int:
        """One that no request of late has carried."""
        return next(self._tokens) % 256

    def identify(self) -> None:
        """See that this is a load cell of the calibration that the wire file says.

        Raises:
            NoReply, BadReply: it is not, or says nothing.
        """
        answer = self._ask("identify")
        if not isinstance(answer, Identity):
            raise BadReply(f"{self._name}: identify was answered by {answer}; check that this is the load cell")
        for what in ("protocol", "counts_per_newton"):
            said, expected = getattr(answer, what), CONTRACT["instrument"][what]
            if said != expected:
                raise BadReply(
                    f"{self._name}: it says {what} {said}, expected {expected}; set it, or mend the wire file"
                )

    def acknowledged(self, command: str, argument: int = 0) -> int:
        """The value with which a command was acknowledged.

        Raises:
            NoReply, BadReply, Refused: it was not.
        """
        answer = self._ask(command, argument)
        if not isinstance(answer, Acknowledgement):
            raise BadReply(f"{self._name}: {command} was answered by {answer}; check that this is the load cell")
        if answer.code:
            reason = _CODES.get(answer.code, f"code {answer.code}")
            raise Refused(f"{self._name}: {command} {argument or ''} refused: {reason}{_HINTS.get(command, '')}")
        return answer.value

    def _ask(self, command: str, argument: int = 0) -> Answer:
        """Send a request until it is answered; its token tells a late answer from the right one."""
        with self._asking:
            request = Request(self.token(), _COMMANDS[command], argument)
            # Tokens come round again: an answer to the one of 256 requests ago would pass for this one's.
            self._stream.answers.pop(request.token, None)
            # Every attempt bears the same token: a late answer to the first is as good as one to the last.
            for _ in range(_DEADLINES["attempts"]):
                self._write(encode(request))
                if (answer := self._answer_to(request)) is not None:
                    return answer
        raise NoReply(
            f"{self._name}: {command} was not answered within {_DEADLINES['reply_s']:.3g} s, "
            f"asked {_DEADLINES['attempts']} times; check power, cable and baud rate"
        )

    def _answer_to(self, request: Request) -> Answer | None:
        deadline = time.monotonic() + _DEADLINES["reply_s"]
        while time.monotonic() < deadline:
            self._read(SLICE)
            answer = self._stream.answers.get(request.token)
            if answer is not None and answer.command == request.command:
                return answer
        return None

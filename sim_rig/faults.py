"""A proxy in a TCP connection that spoils what passes, by a schedule.

It knows bytes and nothing of their meaning, so it can stand in front of any instrument.
"""

import contextlib
import selectors
import socket
import threading
from collections import deque
from collections.abc import Iterable
from pathlib import Path
from typing import Literal

from pydantic import Field, TypeAdapter, ValidationError

from sim_rig.clock import Clock
from sim_rig.errors import ScenarioError
from sim_rig.settings import NotNegative, Positive, Setting, first_fault

_LOOK = 0.01
"""[s] between two looks at the schedule while no bytes come."""
_PATIENCE = 1.0
"""[s] that one end may take to accept bytes before the connection is given up."""


class WireFault(Setting):
    """Something that is wrong with a wire for a while."""

    kind: Literal["late", "cut", "corrupted", "stuck", "closed"] = Field(
        description="late: bytes come later; cut: the second half of each piece is lost; corrupted: one bit in "
        "each piece is turned; stuck: nothing passes, then all at once; closed: no connection"
    )
    start: NotNegative = Field(default=0.0, description="[s] after the wire was opened")
    duration: Positive = Field(description="[s]")
    direction: Literal["from_device", "to_device", "both"] = Field(
        default="from_device", description="which bytes it concerns"
    )
    delay: NotNegative = Field(default=0.0, description="[s] by which late bytes come later")


WIRE_FAULTS = TypeAdapter(dict[str, tuple[WireFault, ...]])
"""Faults by the instrument on whose wire they are."""


def load_wire_faults(path: Path) -> dict[str, tuple[WireFault, ...]]:
    """The faults in a JSON file: instrument to list of faults.

    Raises:
        ScenarioError: the file cannot be read or is not of that form.
    """
    try:
        return WIRE_FAULTS.validate_json(path.read_text("utf-8"))
    except OSError as error:
        raise ScenarioError(f"wire faults {path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise ScenarioError(f"wire faults {path}: no text: {error}") from error
    except ValidationError as error:
        raise ScenarioError(f"wire faults {path}: {first_fault(error)}") from error


class FaultProxy:
    """Listens on loopback and passes everything on to an instrument, but for its faults. A context manager."""

    def __init__(
        self, target: tuple[str, int], clock: Clock, faults: Iterable[WireFault] = (), host: str = "127.0.0.1"
    ) -> None:
        """Listen; nothing is served before `start`.

        Args:
            target: host and port of the instrument.
            clock: of the schedule.
            faults: the schedule, its times counted from now.
            host: where to listen.
        """
        self._target, self._clock, self._began = target, clock, clock.now_ns()
        self._faults = list(faults)
        self._listener = socket.create_server((host, 0))
        self.host, self.port = host, int(self._listener.getsockname()[1])
        self._watched = selectors.DefaultSelector()
        self._watched.register(self._listener, selectors.EVENT_READ)
        self._pipes: list[_Pipe] = []
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._serve, name=f"faults {self.port}", daemon=True)

    def inject(self, fault: WireFault) -> None:
        """Let a fault begin its ``start`` [s] from now."""
        since = (self._clock.now_ns() - self._began) * 1e-9
        self._faults.append(fault.model_copy(update={"start": since + fault.start}))

    def start(self) -> "FaultProxy":
        """Serve from now on."""
        self._thread.start()
        return self

    def stop(self) -> None:
        """Close every connection; harmless when repeated."""
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join()
        self._drop(self._pipes)
        self._listener.close()
        self._watched.close()

    def __enter__(self) -> "FaultProxy":
        return self.start()

    def __exit__(self, *_: object) -> None:
        self.stop()

    def _serve(self) -> None:
        while not self._stopping.is_set():
            for key, _ in self._watched.select(self._wait()):
                if key.data is None:
                    self._accept()
                else:
                    self._take(key.data)
            if any(fault.kind == "closed" for fault in self._active("both")):
                self._drop(self._pipes)
            for pipe in list(self._pipes):
                if not pipe.deliver(self._clock.now_ns(), self._active(pipe.direction)):
                    self._drop([other for other in self._pipes if other.source in (pipe.source, pipe.sink)])

    def _wait(self) -> float:
        # Bytes that wait are due to the millisecond; a fault may begin a moment late.
        return _LOOK / 10 if any(pipe.waiting for pipe in self._pipes) else _LOOK

    def _take(self, pipe: "_Pipe") -> None:
        pipe.take(self._clock.now_ns(), self._active(pipe.direction))
        if pipe.ended:
            self._watched.unregister(pipe.source)

    def _active(self, direction: str) -> list[WireFault]:
        """The faults of a direction at this moment; every fault if it is ``both``."""
        since = (self._clock.now_ns() - self._began) * 1e-9
        return [
            fault
            for fault in self._faults
            if fault.start <= since < fault.start + fault.duration
            and (direction == "both" or fault.direction in (direction, "both"))
        ]

    def _accept(self) -> None:
        host, _ = self._listener.accept()
        try:
            device = socket.create_connection(self._target, _PATIENCE)
        except OSError:
            host.close()
            return
        # Pieces pass as they came: to hold small ones back is for the schedule alone.
        for end in (host, device):
            end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            end.settimeout(_PATIENCE)
        for pipe in (_Pipe(host, device, "to_device"), _Pipe(device, host, "from_device")):
            self._pipes.append(pipe)
            self._watched.register(pipe.source, selectors.EVENT_READ, pipe)

    def _drop(self, pipes: list["_Pipe"]) -> None:
        for pipe in list(pipes):
            if not pipe.ended:
                self._watched.unregister(pipe.source)
            self._pipes.remove(pipe)
            pipe.source.close()


class _Pipe:
    """One direction of one connection."""

    def __init__(
        self, source: socket.socket, sink: socket.socket, direction: Literal["from_device", "to_device"]
    ) -> None:
        self.source, self.sink, self.direction = source, sink, direction
        self.waiting: deque[tuple[int, bytes]] = deque()
        """Instant [ns] at which it may pass, and bytes."""
        self.ended = False
        """Whether the source has closed."""

    def take(self, now_ns: int, faults: list[WireFault]) -> None:
        """Take a piece from the source."""
        piece = b""
        with contextlib.suppress(OSError):
            piece = self.source.recv(4096)
        self.ended = not piece  # before a fault takes bytes away: an empty piece is the end, a cut one is not
        for fault in faults:
            piece = _spoilt(piece, fault)
        delay = sum(fault.delay for fault in faults if fault.kind == "late")
        if piece:
            self.waiting.append((now_ns + round(delay * 1e9), piece))

    def deliver(self, now_ns: int, faults: list[WireFault]) -> bool:
        """Pass on what is due; whether the connection goes on."""
        if any(fault.kind == "stuck" for fault in faults):  # all of it waits, and passes at once in the end
            return True
        try:
            while self.waiting and self.waiting[0][0] <= now_ns:
                self.sink.sendall(self.waiting[0][1])
                self.waiting.popleft()
        except OSError:
            return False
        return bool(self.waiting) or not self.ended


def _spoilt(piece: bytes, fault: WireFault) -> bytes:
    if fault.kind == "cut":
        return piece[: len(piece) // 2]
    if fault.kind == "corrupted" and piece:
        middle = len(piece) // 2
        return piece[:middle] + bytes([piece[middle] ^ 0x10]) + piece[middle + 1 :]
    return piece

"""Proxy that applies faults to a TCP connection by a schedule.

It handles bytes without their meaning, so it works with any instrument.
"""

import contextlib
import selectors
import socket
import threading
from collections import deque
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, NonNegativeFloat, PositiveFloat, TypeAdapter, ValidationError

from sim_rig.errors import ScenarioError
from sim_rig.live import RigClock
from sim_rig.validation import FrozenModel, describe_first_error

_POLL_PERIOD = 0.01
"""[s] between two checks of the schedule while no bytes arrive."""
_CONNECT_TIMEOUT = 1.0
"""[s] after which the connection is closed if one end does not accept bytes."""


_FORMER_KINDS = {"late": "delayed", "cut": "truncated", "stuck": "stalled"}


def _rename_kind(kind: Any) -> Any:
    return _FORMER_KINDS.get(kind, kind) if isinstance(kind, str) else kind


class WireFault(FrozenModel):
    """A fault of a wire for a while."""

    kind: Annotated[
        Literal["delayed", "truncated", "corrupted", "stalled", "closed"], BeforeValidator(_rename_kind)
    ] = Field(
        description="delayed: bytes arrive later; truncated: the second half of each piece is lost; corrupted: "
        "a bit in each piece is flipped; stalled: nothing passes, then all at once; closed: no connection"
    )
    start: NonNegativeFloat = Field(default=0.0, description="[s] after the wire was opened")
    duration: PositiveFloat = Field(description="[s]")
    direction: Literal["from_device", "to_device", "both"] = Field(
        default="from_device", description="direction of the bytes that it affects"
    )
    delay: NonNegativeFloat = Field(default=0.0, description="[s] delay of delayed bytes")


WIRE_FAULTS = TypeAdapter(dict[str, tuple[WireFault, ...]])
"""Faults of wires, by instrument."""


def load_wire_faults(path: Path) -> dict[str, tuple[WireFault, ...]]:
    """Return the faults in a JSON file: instrument to list of faults.

    Raises:
        ScenarioError: the file cannot be read or is not of that form.
    """
    try:
        return WIRE_FAULTS.validate_json(path.read_text("utf-8"))
    except OSError as error:
        raise ScenarioError(f"wire faults {path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise ScenarioError(f"wire faults {path}: is not a text file: {error}") from error
    except ValidationError as error:
        raise ScenarioError(f"wire faults {path}: {describe_first_error(error)}") from error


class FaultProxy:
    """TCP proxy on loopback that forwards bytes to an instrument and applies faults; a context manager."""

    def __init__(
        self, target: tuple[str, int], clock: RigClock, faults: Iterable[WireFault] = (), host: str = "127.0.0.1"
    ) -> None:
        """Open the port; connections are served from `start` on.

        Args:
            target: host and port of the instrument.
            clock: of the schedule.
            faults: the schedule, with times from now.
            host: address to listen on.
        """
        self._target, self._clock, self._start_ns = target, clock, clock.now_ns()
        self._faults = list(faults)
        self._listener = socket.create_server((host, 0))
        self.host, self.port = host, int(self._listener.getsockname()[1])
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._pipes: list[_Pipe] = []
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._serve, name=f"faults {self.port}", daemon=True)

    def inject(self, fault: WireFault) -> None:
        """Add a fault that begins its ``start`` [s] from now."""
        since = (self._clock.now_ns() - self._start_ns) * 1e-9
        self._faults.append(fault.model_copy(update={"start": since + fault.start}))

    def start(self) -> "FaultProxy":
        """Start to serve."""
        self._thread.start()
        return self

    def stop(self) -> None:
        """Close every connection; harmless when repeated."""
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join()
        self._close_pipes(self._pipes)
        self._listener.close()
        self._selector.close()

    def __enter__(self) -> "FaultProxy":
        return self.start()

    def __exit__(self, *_: object) -> None:
        self.stop()

    def _serve(self) -> None:
        while not self._stopping.is_set():
            for key, _ in self._selector.select(self._compute_wait()):
                if key.data is None:
                    self._accept()
                else:
                    self._receive(key.data)
            if any(fault.kind == "closed" for fault in self._select_active("both")):
                self._close_pipes(self._pipes)
            for pipe in list(self._pipes):
                if not pipe.deliver(self._clock.now_ns(), self._select_active(pipe.direction)):
                    self._close_pipes([other for other in self._pipes if other.source in (pipe.source, pipe.sink)])

    def _compute_wait(self) -> float:
        # Queued bytes are due to the millisecond, but a fault may begin some milliseconds late.
        return _POLL_PERIOD / 10 if any(pipe.queue for pipe in self._pipes) else _POLL_PERIOD

    def _receive(self, pipe: "_Pipe") -> None:
        pipe.receive(self._clock.now_ns(), self._select_active(pipe.direction))
        if pipe.source_closed:
            self._selector.unregister(pipe.source)

    def _select_active(self, direction: str) -> list[WireFault]:
        """Return the active faults of a direction; of every direction for ``both``."""
        since = (self._clock.now_ns() - self._start_ns) * 1e-9
        return [
            fault
            for fault in self._faults
            if fault.start <= since < fault.start + fault.duration
            and (direction == "both" or fault.direction in (direction, "both"))
        ]

    def _accept(self) -> None:
        host, _ = self._listener.accept()
        try:
            device = socket.create_connection(self._target, _CONNECT_TIMEOUT)
        except OSError:
            host.close()
            return
        # No delay by the kernel: only the schedule may delay small pieces.
        for end in (host, device):
            end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            end.settimeout(_CONNECT_TIMEOUT)
        for pipe in (_Pipe(host, device, "to_device"), _Pipe(device, host, "from_device")):
            self._pipes.append(pipe)
            self._selector.register(pipe.source, selectors.EVENT_READ, pipe)

    def _close_pipes(self, pipes: list["_Pipe"]) -> None:
        for pipe in list(pipes):
            if not pipe.source_closed:
                self._selector.unregister(pipe.source)
            self._pipes.remove(pipe)
            pipe.source.close()


class _Pipe:
    """One direction of one connection."""

    def __init__(
        self, source: socket.socket, sink: socket.socket, direction: Literal["from_device", "to_device"]
    ) -> None:
        self.source, self.sink, self.direction = source, sink, direction
        self.queue: deque[tuple[int, bytes]] = deque()
        """Instant [ns] from which a piece may pass, and its bytes."""
        self.source_closed = False
        """True if the source has closed."""

    def receive(self, now_ns: int, faults: list[WireFault]) -> None:
        """Receive a piece from the source."""
        piece = b""
        with contextlib.suppress(OSError):
            piece = self.source.recv(4096)
        # Checked before any fault removes bytes: an empty piece is the end, a truncated one is not.
        self.source_closed = not piece
        for fault in faults:
            piece = _corrupt(piece, fault)
        delay = sum(fault.delay for fault in faults if fault.kind == "delayed")
        if piece:
            self.queue.append((now_ns + round(delay * 1e9), piece))

    def deliver(self, now_ns: int, faults: list[WireFault]) -> bool:
        """Send the pieces that are due; return whether the connection stays open."""
        if any(fault.kind == "stalled" for fault in faults):  # the queue passes at once after the fault
            return True
        try:
            while self.queue and self.queue[0][0] <= now_ns:
                self.sink.sendall(self.queue[0][1])
                self.queue.popleft()
        except OSError:
            return False
        return bool(self.queue) or not self.source_closed


def _corrupt(piece: bytes, fault: WireFault) -> bytes:
    if fault.kind == "truncated":
        return piece[: len(piece) // 2]
    if fault.kind == "corrupted" and piece:
        middle = len(piece) // 2
        return piece[:middle] + bytes([piece[middle] ^ 0x10]) + piece[middle + 1 :]
    return piece

"""SDO server of a CANopen slave: object access by requests of eight bytes, long objects in segments."""

import struct
from collections.abc import Callable
from dataclasses import dataclass

from sim_rig.protocols.object_dictionary import ABORT_COMMAND, ABORT_TOGGLE, ObjectDictionary, SdoAbortError


@dataclass
class _Transfer:
    """A segmented transfer in progress."""

    index: int
    sub: int
    upload: bool
    content: bytes
    toggle: bool = False


class SdoServer:
    """SDO server of one node.

    Args:
        objects: of the node.
        on_read: called before an object is read: index, now [ns].
        on_write: called after an object was written: index, sub-index, now [ns].
    """

    def __init__(
        self,
        objects: ObjectDictionary,
        on_read: Callable[[int, int], None],
        on_write: Callable[[int, int, int], None],
    ) -> None:
        self._objects, self._on_read, self._on_write = objects, on_read, on_write
        self._transfer: _Transfer | None = None

    def reset(self) -> None:
        """Discard a transfer in progress when the node restarts."""
        self._transfer = None

    def respond(self, request: bytes, now_ns: int) -> bytes | None:
        """Return the reply to a request, an abort included; None if it needs no reply."""
        try:
            return self._handle(request, now_ns)
        except SdoAbortError as abort:
            self._transfer = None
            return struct.pack("<B3sI", 0x80, request[1:4], abort.code)

    def _handle(self, data: bytes, now_ns: int) -> bytes | None:
        command, index, sub = struct.unpack_from("<BHB", data)
        kind = command >> 5  # 1 and 0: start and segment of a download, 2 and 3: of an upload, 4: abort
        if kind == 4:
            self._transfer = None
            return None
        if kind == 2:
            return self._start_upload(index, sub, now_ns)
        if kind == 1:
            return self._start_download(command, index, sub, data, now_ns)
        if kind in (0, 3) and self._transfer is not None:
            return self._handle_segment(self._transfer, command, data, now_ns)
        raise SdoAbortError(ABORT_COMMAND)

    def _start_upload(self, index: int, sub: int, now_ns: int) -> bytes:
        self._on_read(index, now_ns)
        content = self._objects.upload(index, sub)
        if len(content) <= 4:
            # Expedited transfer, with the number of unused bytes of the four.
            return struct.pack("<BHB4s", 0x43 | (4 - len(content)) << 2, index, sub, content)
        self._transfer = _Transfer(index, sub, True, content)
        return struct.pack("<BHBI", 0x41, index, sub, len(content))

    def _start_download(self, command: int, index: int, sub: int, data: bytes, now_ns: int) -> bytes:
        if command & 0x02:
            size = 4 - ((command >> 2) & 0x3) if command & 0x01 else 4
            self._write(index, sub, data[4 : 4 + size], now_ns)
        else:
            self._transfer = _Transfer(index, sub, False, b"")
        return struct.pack("<BHB4x", 0x60, index, sub)

    def _handle_segment(self, transfer: "_Transfer", command: int, data: bytes, now_ns: int) -> bytes:
        if bool(command & 0x10) != transfer.toggle:
            raise SdoAbortError(ABORT_TOGGLE)
        toggle = 0x10 if transfer.toggle else 0
        transfer.toggle = not transfer.toggle
        if transfer.upload and command >> 5 == 3:
            part, transfer.content = transfer.content[:7], transfer.content[7:]
            last = 0 if transfer.content else 1
            return struct.pack("<B7s", toggle | (7 - len(part)) << 1 | last, part)
        if transfer.upload or command >> 5 != 0:
            raise SdoAbortError(ABORT_COMMAND)
        transfer.content += data[1 : 8 - ((command >> 1) & 0x7)]
        if command & 0x01:
            self._write(transfer.index, transfer.sub, transfer.content, now_ns)
            self._transfer = None
        return struct.pack("<B7x", 0x20 | toggle)

    def _write(self, index: int, sub: int, content: bytes, now_ns: int) -> None:
        self._objects.download(index, sub, content)
        self._on_write(index, sub, now_ns)

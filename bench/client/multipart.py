"""Body of a request that uploads files (multipart/form-data, RFC 7578), read from the disk while it is sent."""

import uuid
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

from bench.client.errors import ClientError

Field: TypeAlias = tuple[str, str | Path]
"""Name of a field, and its text or the file that it contains."""
_LINE_END = b"\r\n"
_ESCAPES = str.maketrans({'"': "%22", "\r": "%0D", "\n": "%0A"})
"""Characters that would end the name of a file, as browsers write them (HTML standard, 4.10.21.8)."""
_CHUNK = 1 << 20
"""Bytes that are read at a time."""


@dataclass(frozen=True)
class MultipartBody:
    """Fields and files of one request; iterating reads the files again."""

    fields: Sequence[Field]
    boundary: str = field(default_factory=lambda: uuid.uuid4().hex)

    @property
    def headers(self) -> dict[str, str]:
        """Headers of the request.

        Raises:
            ClientError: a file cannot be read.
        """
        sizes = (len(head) + _measure(content) + len(_LINE_END) for head, content in self._parts)
        return {
            "Content-Type": f"multipart/form-data; boundary={self.boundary}",
            "Content-Length": str(sum(sizes) + len(self._end)),
        }

    def __iter__(self) -> Iterator[bytes]:
        """Iterate over the bytes of the body.

        Raises:
            ClientError: a file cannot be read.
        """
        for head, content in self._parts:
            yield head
            yield from _read(content)
            yield _LINE_END
        yield self._end

    @property
    def _parts(self) -> Iterator[tuple[bytes, bytes | Path]]:
        for name, value in self.fields:
            described = f'name="{name}"'
            if isinstance(value, Path):
                described += f'; filename="{value.name.translate(_ESCAPES)}"'
            head = f"--{self.boundary}\r\nContent-Disposition: form-data; {described}\r\n\r\n".encode()
            yield head, value if isinstance(value, Path) else value.encode()

    @property
    def _end(self) -> bytes:
        return f"--{self.boundary}--\r\n".encode()


def _measure(content: bytes | Path) -> int:
    if isinstance(content, bytes):
        return len(content)
    try:
        return content.stat().st_size
    except OSError as error:
        raise _make_error(content, error) from error


def _read(content: bytes | Path) -> Iterator[bytes]:
    if isinstance(content, bytes):
        yield content
        return
    try:
        with content.open("rb") as file:
            while chunk := file.read(_CHUNK):
                yield chunk
    except OSError as error:
        raise _make_error(content, error) from error


def _make_error(path: Path, error: OSError) -> ClientError:
    return ClientError(f"{path}: {(error.strerror or str(error)).lower()}; nothing was imported")

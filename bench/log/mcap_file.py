"""Interface to the mcap package: typed wrappers, its errors, and the check for a file's end."""

import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, cast

from mcap.exceptions import McapError
from mcap.stream_reader import CRCValidationError
from mcap.writer import LIBRARY_IDENTIFIER, CompressionType, Writer
from zstandard import ZstdError

from bench.errors import LogError
from bench.log.messages import PROFILE

MAGIC = b"\x89MCAP0\r\n"
"""First and last bytes of a complete file."""

CHUNK_SIZE = 256 * 1024
"""Size [byte] before compression at which a chunk is closed. Larger chunks are read more slowly, and a kill loses
more samples."""

DAMAGE_ERRORS = (McapError, CRCValidationError, ZstdError, struct.error, UnicodeDecodeError, EOFError)
"""Errors that the mcap package raises for a truncated or damaged file."""


def is_closed(file: IO[bytes]) -> bool:
    """Return whether a file has the end that is written when a log is closed; rewinds the file."""
    size = file.seek(0, 2)
    file.seek(max(0, size - len(MAGIC)))
    closed = size >= 2 * len(MAGIC) and file.read() == MAGIC
    file.seek(0)
    return closed


def start_writer(file: IO[bytes]) -> Writer:
    """Return a writer of the profile `mrbench` that has written its header."""
    # The time for checksums is too short to be measured.
    writer = Writer(file, chunk_size=CHUNK_SIZE, compression=CompressionType.ZSTD, enable_data_crcs=True)
    writer.start(PROFILE, f"mrbench {LIBRARY_IDENTIFIER}")
    return writer


def flush(writer: Writer) -> None:
    """Close the chunk and pass everything to the operating system."""
    cast(Callable[[], None], writer.flush)()


def finish(writer: Writer) -> None:
    """Write the index and the end of the file."""
    cast(Callable[[], None], writer.finish)()


@contextmanager
def convert_file_errors(path: Path) -> Iterator[None]:
    """Convert errors of the operating system to an error that names the log.

    Raises:
        LogError: the file cannot be opened, read or written.
    """
    try:
        yield
    except OSError as error:
        raise LogError(f"{path}: {(error.strerror or str(error)).lower()}") from error

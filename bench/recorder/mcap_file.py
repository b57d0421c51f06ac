"""The edge to the mcap package: what of it is untyped, and whose errors become ours."""

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
from bench.recorder.messages import PROFILE

MAGIC = b"\x89MCAP0\r\n"
"""First and last bytes of a whole file."""

# Larger chunks are read more slowly, and a kill costs more of them.
CHUNK_SIZE = 256 * 1024
"""[byte] before compression, beyond which a chunk is closed."""

DAMAGE = (McapError, CRCValidationError, ZstdError, struct.error, UnicodeDecodeError, EOFError)
"""What the mcap package raises on a file that is cut off or damaged."""


def started_writer(file: IO[bytes]) -> Writer:
    """A writer of our profile whose header stands in the file."""
    # Checksums cost no time that could be measured.
    writer = Writer(file, chunk_size=CHUNK_SIZE, compression=CompressionType.ZSTD, enable_data_crcs=True)
    writer.start(PROFILE, f"mrbench {LIBRARY_IDENTIFIER}")
    return writer


def flush(writer: Writer) -> None:
    """End the chunk and hand everything to the operating system."""
    cast(Callable[[], None], writer.flush)()


def finish(writer: Writer) -> None:
    """Write the index and the end of the file."""
    cast(Callable[[], None], writer.finish)()


@contextmanager
def file_errors(path: Path) -> Iterator[None]:
    """Turn errors of the operating system into one that names the log.

    Raises:
        LogError: the file cannot be opened, read or written.
    """
    try:
        yield
    except OSError as error:
        raise LogError(f"{path}: {(error.strerror or str(error)).lower()}") from error

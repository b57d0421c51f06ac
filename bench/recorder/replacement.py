"""Files that appear whole or not at all."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bench.errors import LogError


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A name beside a file to write under; what stands there takes the file's place at the end.

    After an exception nothing is left, and a file that was there before stays as it was.

    Raises:
        LogError: there is no such folder, or it cannot be written to.
    """
    if not path.parent.is_dir():
        raise LogError(f"{path}: there is no folder {path.parent}; make it first")
    # In the same folder: a file takes another's place at once only within one file system.
    beside = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        yield beside
        beside.replace(path)
    except OSError as error:
        raise LogError(f"{path}: {(error.strerror or str(error)).lower()}") from error
    finally:
        beside.unlink(missing_ok=True)

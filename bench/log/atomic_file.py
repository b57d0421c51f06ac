"""Atomic files: they appear complete or not at all."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bench.errors import LogError


@contextmanager
def write_atomically(path: Path) -> Iterator[Path]:
    """Write a file under a temporary name and rename it when the context ends.

    After an exception the temporary file is deleted, and an existing file stays unchanged.

    Yields:
        The temporary path.

    Raises:
        LogError: the folder does not exist or cannot be written to.
    """
    if not path.parent.is_dir():
        raise LogError(f"{path}: the folder {path.parent} does not exist; create it first")
    # Renaming is atomic only within one file system, hence the same folder.
    partial = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        yield partial
        partial.replace(path)
    except OSError as error:
        raise LogError(f"{path}: {(error.strerror or str(error)).lower()}") from error
    finally:
        partial.unlink(missing_ok=True)

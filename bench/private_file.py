"""Files with a secret, which only their owner can read."""

import contextlib
import os
import stat
import tempfile
from collections.abc import Callable
from pathlib import Path

from bench.errors import SecretFileError

_OTHERS = stat.S_IRWXG | stat.S_IRWXO


def create_private_file(path: Path, make_content: Callable[[], str]) -> None:
    """Create a file of mode 0600 unless it exists; of two processes at the same time, one creates it.

    Args:
        path: the file; its folder exists.
        make_content: returns the content of a new file.

    Raises:
        SecretFileError: the folder cannot be written to.
    """
    if path.exists():
        return
    try:
        # Linked when it is complete, so that no process reads a part of it. A temporary file has mode 0600.
        with tempfile.NamedTemporaryFile("w", dir=path.parent, prefix=f".{path.name}-") as file:
            file.write(make_content())
            file.flush()
            os.fsync(file.fileno())
            with contextlib.suppress(FileExistsError):
                os.link(file.name, path)
    except OSError as error:
        raise SecretFileError(f"{path}: cannot be created ({error.strerror}); make its folder writable") from None


def check_private_file(path: Path, purpose: str) -> None:
    """Check that a file exists, and that only its owner can read it.

    Args:
        path: the file.
        purpose: what the file is and where it comes from, for the error of a missing file.

    Raises:
        SecretFileError: it is missing, or other users may read or replace its content.
    """
    try:
        mode = path.stat().st_mode
    except OSError as error:
        raise SecretFileError(f"{path}: cannot be read ({error.strerror}); it is {purpose}") from None
    if mode & _OTHERS:
        raise SecretFileError(
            f"{path}: other users may read it (mode {stat.S_IMODE(mode):04o}, allowed 0600); chmod 600 {path}"
        )

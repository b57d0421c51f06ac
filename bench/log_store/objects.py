"""Objects of a log store: written and read in blocks, each within a time limit.

A store that is silent in the middle of a request has no time limit of its own in every library. So each block is
transferred in a thread that is left to itself when the limit has passed. Errors of libraries name the endpoint and
sometimes the user. So they are replaced by words of ours and are not passed on.
"""

import contextlib
import hashlib
import os
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import fsspec
from fsspec.config import conf

from bench.log import convert_file_errors
from bench.log_store.errors import LogStoreError, LogStoreUnavailableError
from bench.threads import run_within

BLOCK_SIZE = 8 * 2**20
"""Size of a block [bytes]; S3 accepts parts of 5 MiB and more."""
TIME_LIMIT = 60.0
"""[s] Time limit of one block; a connection needs at least 1.2 Mbit/s."""
_S3_OPTIONS = {"config_kwargs": {"connect_timeout": 10, "read_timeout": 20, "retries": {"total_max_attempts": 1}}}
"""Failures are shown soon: the copy itself is repeated."""
_OPTIONS: dict[str, dict[str, Any]] = {"s3": _S3_OPTIONS, "s3a": _S3_OPTIONS}
_T = TypeVar("_T")


def write_object(source: Path, url: str) -> None:
    """Write a file to a store; an object of the same name is replaced.

    Args:
        source: the file.
        url: address of the object; its bucket or folder exists.

    Raises:
        LogError: the file cannot be read.
        LogStoreUnavailableError: the store does not accept the object.
    """
    missing = LogStoreUnavailableError("the bucket or folder of the log store does not exist; create it")
    with convert_file_errors(source), source.open("rb") as file:
        target = _call(lambda: _open(url, "wb"), missing)
        try:
            while block := file.read(BLOCK_SIZE):
                _call(partial(target.write, block), missing)
            _call(target.close, missing)
        except BaseException:
            _abandon(target)
            raise


def read_blocks(url: str) -> Iterator[bytes]:
    """Yield the content of an object.

    Raises:
        LogStoreError: there is no such object.
        LogStoreUnavailableError: the store does not answer.
    """
    missing = LogStoreError(f"{url}: there is no such object in the log store; restore it from a backup")
    file = _call(lambda: _open(url, "rb"), missing)
    while block := _call(lambda: file.read(BLOCK_SIZE), missing):
        yield block


def hash_object(url: str) -> tuple[str, int]:
    """Return SHA-256 in hexadecimal, and size [bytes], of an object as the store returns it.

    Raises:
        LogStoreError: there is no such object.
        LogStoreUnavailableError: the store does not answer.
    """
    digest, size = hashlib.sha256(), 0
    for block in read_blocks(url):
        digest.update(block)
        size += len(block)
    return digest.hexdigest(), size


def _open(url: str, mode: str) -> Any:
    protocol = url.partition("://")[0]
    # Options of the user's own configuration come first.
    options = {
        name: value for name, value in _OPTIONS.get(protocol, {}).items() if name not in conf.get(protocol, {})
    }
    files, path = fsspec.url_to_fs(url, use_listings_cache=False, **options)
    return files.open(path, mode, block_size=BLOCK_SIZE)


def _abandon(file: Any) -> None:
    """Give a file up; closing a buffered one would send the rest, and wait for a store that is away."""
    try:
        file.closed = True
    except AttributeError:  # a file of this machine, or of memory
        with contextlib.suppress(Exception):
            file.close()


def _call(act: Callable[[], _T], missing: LogStoreError) -> _T:
    """Return what a function returns within the time limit; replace its errors by ours.

    Args:
        act: the function.
        missing: error if there is no such object, bucket or folder.
    """
    try:
        return run_within(TIME_LIMIT, act, "log-store")
    except FileNotFoundError:
        raise missing from None
    except Exception as error:
        raise LogStoreUnavailableError(f"the log store {_describe(error)}") from None


def _describe(error: Exception) -> str:
    """Return the reason of a failure in words of ours: those of libraries name endpoint and user."""
    if isinstance(error, PermissionError):
        return "refuses access; check its credentials, and the rights to its bucket or folder"
    if isinstance(error, TimeoutError) or "Timeout" in type(error).__name__:
        return f"does not answer within {TIME_LIMIT:g} s; check whether it runs"
    if isinstance(error, OSError) and error.errno is not None:
        return f"fails: {os.strerror(error.errno).lower()}"
    return f"cannot be reached ({type(error).__name__}); check whether it runs, its endpoint and its credentials"

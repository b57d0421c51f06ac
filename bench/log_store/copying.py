"""Copy of one log to a log store: written, read back, compared by size and digest, and recorded."""

from datetime import UTC, datetime

from bench.catalogue import Catalogue, RunRow, compute_sha256
from bench.errors import LogError
from bench.log_store.errors import LogStoreError
from bench.log_store.objects import hash_object, write_object

_DIGEST_LENGTH = 16
"""Number of hexadecimal digits of the digest in the name of an object."""


def make_object_url(store: str, row: RunRow) -> str:
    """Return the address of the copy of a log; one address has one content, so that no copy replaces another.

    Args:
        store: address of the store.
        row: run with a stored hash.
    """
    stem = row.log.rpartition("/")[2].removesuffix(".mcap")
    return f"{store}/{stem}.{(row.log_sha256 or '')[:_DIGEST_LENGTH]}.mcap"


def copy_log(catalogue: Catalogue, row: RunRow, store: str) -> RunRow:
    """Copy the log of a run to a store, read the copy back, and record it in the catalogue.

    Args:
        catalogue: the catalogue of the data folder.
        row: run with a stored hash.
        store: address of the store.

    Returns:
        The run with the address of its copy.

    Raises:
        LogError: the log cannot be read, or is not the one that was recorded.
        LogStoreError: the copy has another content.
        LogStoreUnavailableError: the store cannot be reached.
    """
    path, url = catalogue.resolve_path(row.log), make_object_url(store, row)
    found = compute_sha256(path)
    if found != row.log_sha256:
        raise LogError(f"{row.log} was changed: SHA-256 {found}, recorded {row.log_sha256}; it is not copied")
    write_object(path, url)
    check_object(url, row)
    return catalogue.update_run(row.id, copy_url=url, copied=datetime.now(UTC))


def check_object(url: str, row: RunRow) -> None:
    """Compare an object with the log that was recorded.

    Raises:
        LogStoreError: it is missing, or has another size or digest.
        LogStoreUnavailableError: the store cannot be reached.
    """
    digest, size = hash_object(url)
    if digest != row.log_sha256 or size != row.log_bytes:
        raise make_content_error(url, row, digest, size)


def make_content_error(url: str, row: RunRow, digest: str, size: int) -> LogStoreError:
    """Return the error for an object with another content than the log that was recorded."""
    return LogStoreError(
        f"{url} has another content than the recorded log: {size} bytes with SHA-256 {digest}, recorded "
        f"{row.log_bytes} bytes with {row.log_sha256}; it is not used; restore it from a backup"
    )

"""Address of a log store: a URL that fsspec reads, which the data folder keeps.

Messages, logs and the catalogue show this address. So it contains no password: credentials are taken from the
environment or from the configuration of fsspec.
"""

from pathlib import Path
from urllib.parse import urlsplit

import fsspec

from bench.log_store.errors import LogStoreError

STORE_FILE = "logs.url"
"""File in a data folder with the URL of its log store."""
_FORM = "give a URL such as s3://BUCKET/PREFIX or file:///FOLDER"


def check_store_url(url: str) -> str:
    """Return the URL of a log store without a slash at its end.

    Raises:
        LogStoreError: it is not a URL, contains a password or a query, or no installed package reads it.
    """
    # The URL is not repeated: it may contain a secret.
    try:
        parts = urlsplit(url)
        has_more = bool(parts.password or parts.query or parts.fragment)
    except ValueError:
        raise LogStoreError(f"the address of the log store cannot be read; {_FORM}") from None
    if has_more or "::" in url:
        raise LogStoreError(
            f"the address of the log store contains a password or a query; {_FORM}, and the credentials in the "
            "environment"
        )
    if not parts.scheme or "://" not in url or not (parts.netloc or parts.path):
        raise LogStoreError(f"the address of the log store is not a URL with a bucket or folder; {_FORM}")
    _check_protocol(parts.scheme)
    return url.rstrip("/")


def _check_protocol(protocol: str) -> None:
    try:
        fsspec.get_filesystem_class(protocol)
    except ValueError:
        raise LogStoreError(f"{protocol}:// is not known to fsspec; {_FORM}") from None
    except ImportError as error:
        extra = "; pip install 'mrbench[s3]'" if protocol in ("s3", "s3a") else ""
        raise LogStoreError(f"a package that reads {protocol}:// is missing ({error}){extra}") from None


def find_store(data: Path) -> str | None:
    """Return the URL of the log store of a data folder; None if it has none.

    Raises:
        LogStoreError: the kept URL is not valid, or cannot be read.
    """
    path = data / STORE_FILE
    try:
        return check_store_url(path.read_text("utf-8").strip()) if path.is_file() else None
    except (OSError, UnicodeDecodeError) as error:
        raise LogStoreError(f"{path}: cannot be read ({error}); remove it, or give --log-store") from None


def keep_store_url(data: Path, url: str) -> None:
    """Keep the URL of a log store in its data folder, so that later starts and commands find it.

    Args:
        data: data folder; it exists.
        url: address of the store; it replaces the former one, whose copies stay known.

    Raises:
        LogStoreError: the URL is not valid, or the folder cannot be written to.
    """
    path, checked = data / STORE_FILE, check_store_url(url)
    written = path.with_name(f".{STORE_FILE}")
    try:
        written.write_text(f"{checked}\n", "utf-8")
        written.replace(path)
    except OSError as error:
        raise LogStoreError(f"{path}: cannot be written ({error.strerror}); make its folder writable") from None

"""Backup of a data folder while its service runs, and its restoration to another folder.

The database is copied first, by its own means, which are consistent at one moment. The files follow: those
that the copied catalogue names are complete by then and never change. A log that is being recorded is copied as it
is, so that it is found truncated after a restoration. The restored service catalogues files that came later.
"""

import shutil
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

from bench.catalogue.database import (
    ADDRESS_FILE,
    CATALOGUE_FILE,
    SQLITE,
    dump_database,
    find_catalogue,
    keep_address,
    parse_address,
    parse_server_address,
    restore_database,
)
from bench.catalogue.errors import CatalogueError
from bench.errors import BenchError
from bench.folder_lock import LOCK_FILE

DUMP_FILE = "catalogue.dump"
"""File in a backup with a catalogue of PostgreSQL, in the format of `pg_dump --format=custom`."""
_NOT_COPIED = (LOCK_FILE, "scheduler.address", "token", "jobs.pem", ADDRESS_FILE, DUMP_FILE)
"""Files of a running service, and secrets."""
_NOT_COPIED_ENDINGS = (".log", f"{CATALOGUE_FILE}-wal", f"{CATALOGUE_FILE}-shm", CATALOGUE_FILE)


class Copied(NamedTuple):
    """Content of a backup, or of a restored folder."""

    runs: int
    files: int
    size: int
    """[bytes]"""


def back_up(data: Path, target: Path) -> Copied:
    """Copy catalogue, logs and results of a data folder to a new folder.

    Args:
        data: data folder; its service may run.
        target: folder that does not exist; it appears complete or not at all.

    Raises:
        CatalogueError: the data folder has no catalogue, the target exists, or cannot be written.
    """
    address = parse_address(find_catalogue(data))
    if address.drivername == SQLITE:
        return _copy(data, target, lambda partial: _copy_database(data, partial))
    return _copy(data, target, lambda partial: dump_database(address, partial / DUMP_FILE))


def restore_backup(backup: Path, data: Path, url: str | None = None) -> Copied:
    """Copy a backup to a data folder that does not exist or is empty.

    Args:
        backup: folder of the backup.
        data: data folder.
        url: empty PostgreSQL database for a catalogue of PostgreSQL; None for one of SQLite.

    Raises:
        CatalogueError: the backup has no catalogue, a damaged one or one of the other kind, or the data folder or
            the database is in use.
    """
    has_dump = (backup / DUMP_FILE).is_file()
    if not has_dump:
        find_catalogue(backup)
    if has_dump != (url is not None):
        wanted = "give --catalogue with the URL of an empty database" if has_dump else "leave --catalogue out"
        kind = "PostgreSQL" if has_dump else "SQLite"
        raise CatalogueError(f"{backup}: its catalogue is one of {kind}; {wanted}")
    if data.is_dir() and not any(data.iterdir()):
        data.rmdir()
    if url is None:
        return _copy(backup, data, lambda partial: _copy_database(backup, partial))
    return _restore_dump(backup, data, url)


def _restore_dump(backup: Path, data: Path, url: str) -> Copied:
    """Copy the files first: the database is then filled completely or not at all."""
    address = parse_server_address(url)
    copied = _copy(backup, data, lambda partial: 0)
    try:
        runs = restore_database(backup / DUMP_FILE, address)
        keep_address(data, url)
    except BenchError:
        shutil.rmtree(data, ignore_errors=True)
        raise
    return copied._replace(runs=runs)


def _copy(source: Path, target: Path, copy_database: Callable[[Path], int]) -> Copied:
    """Copy a folder that appears complete or not at all.

    Args:
        source: folder.
        target: folder that does not exist.
        copy_database: copies the database to a folder, and returns its number of runs.
    """
    if target.exists():
        raise CatalogueError(f"{target}: it exists; nothing was changed; choose a folder that does not exist")
    partial = target.with_name(f".{target.name}.part")
    try:
        partial.mkdir(parents=True)
        runs = copy_database(partial)
        sizes = [_copy_file(path, partial / path.relative_to(source)) for path in _list_files(source, partial)]
        partial.rename(target)
    except CatalogueError:
        shutil.rmtree(partial, ignore_errors=True)
        raise
    except (OSError, sqlite3.Error) as error:
        shutil.rmtree(partial, ignore_errors=True)
        raise CatalogueError(f"{target}: the copy of {source} failed ({error}); nothing was kept") from error
    return Copied(runs, len(sizes), sum(sizes))


def _copy_database(source: Path, target: Path) -> int:
    """Copy an SQLite database at one moment, check the copy, and return its number of runs."""
    files = source / CATALOGUE_FILE, target / CATALOGUE_FILE
    with closing(sqlite3.connect(files[0])) as origin, closing(sqlite3.connect(files[1])) as copy:
        origin.backup(copy)
        finding = copy.execute("PRAGMA integrity_check").fetchone()[0]
        if finding != "ok":
            raise sqlite3.DatabaseError(f"the catalogue is damaged: {finding}")
        runs: int = copy.execute("SELECT COUNT(*) FROM runs").fetchone()[0]
        return runs


def _list_files(source: Path, partial: Path) -> Iterator[Path]:
    """Yield the files to copy; hidden ones are incomplete."""
    for path in sorted(source.rglob("*")):
        names = path.relative_to(source).parts
        is_wanted = path.name not in _NOT_COPIED and not path.name.endswith(_NOT_COPIED_ENDINGS)
        is_hidden = any(name.startswith(".") for name in names)
        if is_wanted and not is_hidden and path.is_file() and not path.is_relative_to(partial):
            yield path


def _copy_file(source: Path, target: Path) -> int:
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy2(source, target)
    return target.stat().st_size

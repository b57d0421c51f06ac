"""Backup of a data folder while its service runs, and its restoration to another folder.

The database is copied first, by SQLite's own backup, which is consistent at one moment. The files follow: those
that the copied catalogue names are complete by then and never change. A log that is being recorded is copied as it
is, so that it is found truncated after a restoration. The restored service catalogues files that came later.
"""

import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

from bench.catalogue.database import CATALOGUE_FILE, find_catalogue
from bench.catalogue.errors import CatalogueError

_NOT_COPIED = ("service.lock", "scheduler.address", "token", "jobs.pem")
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
    find_catalogue(data)
    return _copy(data, target)


def restore_backup(backup: Path, data: Path) -> Copied:
    """Copy a backup to a data folder that does not exist or is empty.

    Raises:
        CatalogueError: the backup has no catalogue or a damaged one, or the data folder is in use.
    """
    find_catalogue(backup)
    if data.is_dir() and not any(data.iterdir()):
        data.rmdir()
    return _copy(backup, data)


def _copy(source: Path, target: Path) -> Copied:
    if target.exists():
        raise CatalogueError(f"{target}: it exists; nothing was changed; choose a folder that does not exist")
    partial = target.with_name(f".{target.name}.part")
    try:
        partial.mkdir(parents=True)
        runs = _copy_database(source / CATALOGUE_FILE, partial / CATALOGUE_FILE)
        sizes = [_copy_file(path, partial / path.relative_to(source)) for path in _list_files(source, partial)]
        partial.rename(target)
    except (OSError, sqlite3.Error) as error:
        shutil.rmtree(partial, ignore_errors=True)
        raise CatalogueError(f"{target}: the copy of {source} failed ({error}); nothing was kept") from error
    return Copied(runs, len(sizes), sum(sizes))


def _copy_database(source: Path, target: Path) -> int:
    """Copy a database at one moment, check the copy, and return its number of runs."""
    with closing(sqlite3.connect(source)) as origin, closing(sqlite3.connect(target)) as copy:
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

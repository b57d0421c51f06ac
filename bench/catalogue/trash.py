"""Trash: a run and its log are put aside, and can be restored; nothing is deleted."""

from datetime import UTC, datetime
from pathlib import Path

from bench.catalogue.catalogue import Catalogue
from bench.catalogue.models import RunRow
from bench.errors import LogError

TRASH_FOLDER = "trash"
"""Folder of the logs in the trash, in the data folder; the scan does not look into it."""


def move_to_trash(catalogue: Catalogue, row: RunRow) -> RunRow:
    """Move a run and its log to the trash; its results stay where they are.

    Raises:
        LogError: the log cannot be moved, or another file is in its place.
    """
    return catalogue.update_run(
        row.id, trashed=datetime.now(UTC), log=_move_log(catalogue, row, catalogue.folder / TRASH_FOLDER)
    )


def restore_from_trash(catalogue: Catalogue, row: RunRow) -> RunRow:
    """Move a run and its log back from the trash.

    Raises:
        LogError: the log cannot be moved, or another file is in its place.
    """
    return catalogue.update_run(row.id, trashed=None, log=_move_log(catalogue, row, catalogue.folder))


def _move_log(catalogue: Catalogue, row: RunRow, folder: Path) -> str:
    """Move the log of a run to a folder, and return its name; a log that is outside the data folder stays."""
    path = catalogue.resolve_path(row.log)
    target = folder / path.name
    if not path.is_relative_to(catalogue.folder):
        return row.log
    if path.exists() and path != target:
        _rename(path, target)
    # A kill between the move and its record leaves the log at its target; the next attempt then records it.
    return catalogue.make_name(target) if target.exists() else row.log


def _rename(path: Path, target: Path) -> None:
    if target.exists():
        raise LogError(f"{target}: another file is in the place of {path.name}; move it away first")
    try:
        target.parent.mkdir(exist_ok=True)
        path.rename(target)
    except OSError as error:
        raise LogError(f"{path} cannot be moved to {target.parent}: {error.strerror}") from error

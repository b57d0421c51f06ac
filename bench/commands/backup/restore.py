"""``mrbench restore``: a data folder from a backup."""

from pathlib import Path
from typing import Annotated

import typer


def restore(
    backup: Annotated[Path, typer.Argument(metavar="BACKUP", help="Folder written by `mrbench backup`.")],
    data: Annotated[
        Path, typer.Option(metavar="DIR", help="Data folder to create; it must be empty or not exist.")
    ] = Path("runs"),
    catalogue: Annotated[
        str | None,
        typer.Option(
            metavar="URL",
            help="Empty PostgreSQL database, for a backup with a catalogue of PostgreSQL.",
        ),
    ] = None,
) -> None:
    """Copy a backup to a new data folder.

    It is for `mrbench serve --data`; nothing is overwritten. `pg_restore` writes a catalogue of PostgreSQL, all of
    it or nothing. `mrbench verify` then compares all logs with the hashes of their recording.
    """
    from bench.catalogue import restore_backup

    copied = restore_backup(backup.resolve(), data.resolve(), catalogue)
    typer.echo(f"{data}: {copied.runs} runs, {copied.files} files, {copied.size / 1e6:.1f} MB", err=True)

"""``mrbench backup``: copy of a data folder while its service runs."""

from pathlib import Path
from typing import Annotated

import typer


def backup(
    out: Annotated[Path, typer.Option(metavar="DIR", help="New folder for the copy; it must not exist.")],
    data: Annotated[Path, typer.Argument(metavar="DIR", help="Data folder of the service.")] = Path("runs"),
) -> None:
    """Copy catalogue, logs and results of a data folder.

    The service may run and record meanwhile. The copy appears complete or not at all. A log that is being recorded
    is copied up to this moment. Secrets that a new service creates again are left out; the token stays valid.
    A catalogue in PostgreSQL is written by `pg_dump` to the file `catalogue.dump`, and its address is left out.
    """
    from bench.catalogue import back_up

    copied = back_up(data.resolve(), out.resolve())
    typer.echo(f"{out}: {copied.runs} runs, {copied.files} files, {copied.size / 1e6:.1f} MB", err=True)

"""``mrbench verify``: comparison of the logs in a data folder with the hashes in its catalogue."""

from pathlib import Path
from typing import Annotated

import typer


def verify(
    data: Annotated[Path, typer.Argument(metavar="DIR", help="Data folder of the service.")] = Path("runs"),
) -> None:
    """Check that the recorded logs are unchanged.

    Compares them with the hashes of their recording. Lists each log that was changed or is missing, and then exits
    with status 1. A log that was removed after its copy is read from the log store. The service may run meanwhile.
    """
    from bench.catalogue import check_all, open_catalogue
    from bench.errors import LogError
    from bench.log_store import hash_object

    folder = data.resolve()
    with open_catalogue(folder) as catalogue:
        rows = list(check_all(catalogue, lambda url: hash_object(url)[0]))
    damaged = [row for row in rows if row.integrity != "intact"]
    for row in damaged:
        found = f": recorded {row.log_sha256}, found {row.found_sha256}" if row.found_sha256 else ""
        typer.echo(f"{row.log}: {row.integrity}{found}")
    typer.echo(f"{len(rows) - len(damaged)} of {len(rows)} logs are unchanged since they were recorded")
    if damaged:
        raise LogError(
            f"{folder}: {len(damaged)} logs were changed or are missing; restore them from a backup; their fits "
            "stand as those of the recorded logs"
        )

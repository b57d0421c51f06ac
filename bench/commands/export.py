"""``mrbench export``: samples of a log as CSV, Parquet or MATLAB file."""

from pathlib import Path
from typing import Annotated

import typer


def export(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log to export.")],
    format_: Annotated[
        str, typer.Option("--format", metavar="FORMAT", help="csv, parquet (needs the extra `export`) or mat.")
    ],
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="File to write; by default the log's path with another ending."),
    ] = None,
) -> None:
    """Write the samples of a log to a file for other tools.

    Column names contain the unit. A CSV file can be imported again with `mrbench import`.
    """
    from bench.log import FORMATS, export_log, read_log

    file_format = next((known for known in FORMATS if known == format_), None)
    if file_format is None:
        raise typer.BadParameter(f"{format_!r} is not one of {', '.join(FORMATS)}")
    file = out or log.with_suffix(f".{file_format}")
    export_log(read_log(log), file_format, file)
    typer.echo(str(file), err=True)

"""``mrbench export``: the samples of a log for other tools."""

from pathlib import Path
from typing import Annotated

import typer


def export(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A recording.")],
    format_: Annotated[
        str, typer.Option("--format", metavar="FORMAT", help="csv, parquet (wants the extra `export`) or mat.")
    ],
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The file to write; by default beside the log, under its name."),
    ] = None,
) -> None:
    """Write the samples of a log for other tools.

    The unit stands in every column's name. A CSV can be imported again with `mrbench import`.
    """
    from bench.recorder.export import FORMATS, export_log
    from bench.recorder.reader import read_log

    form = next((known for known in FORMATS if known == format_), None)
    if form is None:
        raise typer.BadParameter(f"{format_!r} is not one of {', '.join(FORMATS)}")
    file = out or log.with_suffix(f".{form}")
    export_log(read_log(log), form, file)
    typer.echo(str(file), err=True)

"""``mrbench salvage``: repairs a log whose recorder was killed."""

from pathlib import Path
from typing import Annotated

import typer


def salvage(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="The broken log.")],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Where the mended log goes; by default it replaces the broken one, kept as LOG.broken.",
        ),
    ] = None,
) -> None:
    """Repair a truncated log and say what was lost.

    Every closed chunk is kept. A log that is whole is left untouched.
    """
    from bench.recorder.salvage import salvage as mend

    typer.echo(str(mend(log, out)))

"""``mrbench salvage``: repair of a truncated log."""

from pathlib import Path
from typing import Annotated

import typer


def salvage(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Truncated log.")],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Repaired log; by default it replaces the truncated one, which is kept as LOG.broken.",
        ),
    ] = None,
) -> None:
    """Repair a log whose recorder was killed.

    Reports the lost samples. All closed chunks are kept. A complete log is not changed.
    """
    from bench.log import salvage_log

    typer.echo(str(salvage_log(log, out)))

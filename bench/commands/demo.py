"""``mrbench demo``: from the simulated rig to a report, as a person would do it."""

from pathlib import Path
from typing import Annotated

import typer


def demo(
    quick: Annotated[
        bool, typer.Option("--quick", help="A shorter method, and no second recording of unseen strokes.")
    ] = False,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where everything goes.")] = Path("runs/demo"),
) -> None:
    """Record six drives on the simulated rig, identify the damper, predict unseen strokes and write a report."""
    from rich.console import Console

    from bench.demo import Demo, carry_out, summarise

    planned = Demo(out, "quick", None) if quick else Demo(out, "six_voltages", "validation")
    if not carry_out(planned, Console(stderr=True)):
        raise typer.Exit(1)
    summarise(planned, Console())

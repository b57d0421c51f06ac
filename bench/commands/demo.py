"""``mrbench demo``: from the simulated rig to a report, as a person would do it."""

from pathlib import Path
from typing import Annotated

import typer


def demo(
    quick: Annotated[
        bool, typer.Option("--quick", help="A shorter method, and no second recording of unseen strokes.")
    ] = False,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where everything goes.")] = Path("runs/demo"),
    serve: Annotated[bool, typer.Option("--serve", help="Leave the bench up in the end, with its page.")] = False,
) -> None:
    """Bring up a simulated bench and show all of it at work.

    It records six drives over its wires, identifies the damper, predicts strokes that the fit never saw, looks for
    what the simulation lacks, and writes a report.
    """
    from rich.console import Console

    from bench.demo.demo import Demo
    from bench.demo.folder import DemoFolder

    folder = DemoFolder(out, "quick", None) if quick else DemoFolder(out, "six_voltages", "validation")
    Demo(folder, Console(stderr=True)).carry_out(Console(), serve=serve)

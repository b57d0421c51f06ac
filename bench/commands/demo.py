"""``mrbench demo``: a complete test on the simulated rig, from recording to report."""

from pathlib import Path
from typing import Annotated

import typer


def demo(
    quick: Annotated[
        bool, typer.Option("--quick", help="Use a shorter method, and record no validation strokes.")
    ] = False,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for all results.")] = Path("runs/demo"),
    serve: Annotated[
        bool, typer.Option("--serve", help="Keep the bench and its page running afterwards.")
    ] = False,
) -> None:
    """Start a simulated bench and demonstrate a complete test.

    Records strokes at six drives over the instruments' wires, identifies the damper, predicts validation strokes,
    diagnoses the sim-to-real gap, and writes a report.
    """
    from rich.console import Console

    from bench.demo import Demo, DemoFolder

    folder = DemoFolder(out, "quick", None) if quick else DemoFolder(out, "six_voltages", "validation")
    Demo(folder, Console(stderr=True)).run(Console(), serve=serve)

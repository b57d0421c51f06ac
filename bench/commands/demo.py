"""``mrbench demo``: a complete test on the simulated rig, from recording to report."""

from pathlib import Path
from typing import Annotated

import typer


def demo(
    quick: Annotated[
        bool, typer.Option("--quick", help="Use a shorter method, and record no second run for the twin.")
    ] = False,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for all results.")] = Path("runs/demo"),
    serve: Annotated[
        bool,
        typer.Option(
            "--serve", help="Keep the bench and its page running afterwards, with three recorded runs to explore."
        ),
    ] = False,
    seed: Annotated[
        int, typer.Option(metavar="N", min=0, help="Seed of the hidden effect; the same seed hides the same one.")
    ] = 1,
) -> None:
    """Start a simulated bench with a hidden effect, and find it.

    Records strokes at six drives over the instruments' wires, identifies the damper, diagnoses the sim-to-real
    gap, and plays the twin on a second recording. Only then it opens the truth, and states whether the name was
    right.
    """
    from rich.console import Console

    from bench.demo import Demo, DemoFolder

    full = DemoFolder(out, "six_voltages", "validation", seed, ("quick",))
    folder = DemoFolder(out, "quick", None, seed, ("validation", "multisine")) if quick else full
    Demo(folder, Console(stderr=True)).run(Console(), serve=serve)

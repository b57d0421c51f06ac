"""`mrbench foresee`: what planned strokes can tell."""

from pathlib import Path
from typing import Annotated

import typer


def foresee(
    planned: Annotated[
        Path, typer.Argument(metavar="PLANNED.npz", help="Planned strokes, as `run --dry-run` makes them.")
    ],
    out: Annotated[Path, typer.Option("--out", help="Where the document goes; `-` prints it.")],
    model: Annotated[
        Path | None,
        typer.Option(metavar="FIT", help="The damper to expect: a fit, a twin or a scenario; else a usual one."),
    ] = None,
    noise: Annotated[
        float | None, typer.Option(metavar="N", min=1e-6, help="Noise of the recorded force [N].")
    ] = None,
) -> None:
    """Say how well planned strokes can fix each parameter, and which stroke to add; `run --dry-run` calls it."""
    from identification.document_file import check_place, write_document
    from identification.foresight.assumed import assumed_damper
    from identification.foresight.foresee import foresee as judge
    from identification.foresight.planned import read_planned

    check_place(out)
    strokes = read_planned(planned)
    write_document(out, judge(strokes, assumed_damper(model, strokes.drive_unit, noise)))

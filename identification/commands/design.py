"""`mrbench foresee`: expected precision of planned strokes."""

from pathlib import Path
from typing import Annotated

import typer


def foresee(
    planned: Annotated[
        Path,
        typer.Argument(metavar="PLANNED.npz", help="Planned strokes, as `run --dry-run --planned` writes them."),
    ],
    out: Annotated[Path, typer.Option("--out", help="Document to write; `-` prints it.")],
    model: Annotated[
        Path | None,
        typer.Option(metavar="FIT", help="Expected damper: a fit, twin or scenario; a typical damper by default."),
    ] = None,
    noise: Annotated[
        float | None, typer.Option(metavar="N", min=1e-6, help="Standard deviation of the force noise [N].")
    ] = None,
) -> None:
    """Estimate how precisely planned strokes identify a damper.

    States the precision of each parameter, and proposes one more stroke.
    """
    from identification.documents import check_output_path, write_document
    from identification.experiment_design import assess_design, load_assumed_damper, read_planned_strokes

    check_output_path(out)
    strokes = read_planned_strokes(planned)
    write_document(out, assess_design(strokes, load_assumed_damper(model, strokes.drive_unit, noise)))

"""The commands of this package: `mrbench diagnose` and `mrbench trend`."""

from pathlib import Path
from typing import Annotated

import typer


def diagnose(
    logs: Annotated[
        list[Path], typer.Argument(metavar="LOG...", help="Logs of one specimen, as recorded or imported.")
    ],
    out: Annotated[Path, typer.Option("--out", help="Where the document goes; `-` prints it.")],
    model: Annotated[
        Path | None,
        typer.Option(
            metavar="FIT|TWIN|SCENARIO",
            help="A simulation of this damper, whose own gap is reported too.",
        ),
    ] = None,
    twin: Annotated[
        Path | None, typer.Option(help="Where the scenario goes that plays the damper with what was found.")
    ] = None,
    witness: Annotated[
        bool,
        typer.Option(
            "--witness",
            help="Also train a network with the named effects in its residual, and say whether it finds the same.",
        ),
    ] = False,
    seed: Annotated[int, typer.Option(help="Of the scattered starts.")] = 1,
) -> None:
    """Say where simulation and recording differ, which effect is missing, and how far adding it closes the gap."""
    from identification.document_file import check_place, place_in_words, write_document
    from identification.gap.diagnose import diagnose as answer
    from identification.gap.model import read_model
    from identification.gap.words import summary
    from identification.progress import progress_on_terminal
    from identification.recordings import load

    for place in (out, twin):
        if place is not None:
            check_place(place)
    given = None if model is None else read_model(model)
    with progress_on_terminal("diagnose") as progress:
        found = answer([load(log) for log in logs], given, seed=seed, witness=witness, progress=progress)
    write_document(out, found.diagnosis)
    if twin is not None:
        write_document(twin, found.twin)
    typer.echo(f"{place_in_words(out)}: {summary(found.diagnosis)}", err=True)


def trend(
    logs: Annotated[
        list[Path], typer.Argument(metavar="LOG...", help="Logs of one specimen, one a run, in the order of time.")
    ],
    out: Annotated[Path, typer.Option("--out", help="Where the document goes; `-` prints it.")],
    seed: Annotated[int, typer.Option(help="Of the scattered starts.")] = 1,
) -> None:
    """Say what grows or falls over the runs of one specimen, by how much a run, and since which."""
    from identification.document_file import check_place, place_in_words, write_document
    from identification.gap.trend import trend as answer
    from identification.progress import progress_on_terminal
    from identification.recordings import load

    check_place(out)
    with progress_on_terminal("trend") as progress:
        found = answer([load(log) for log in logs], seed=seed, progress=progress)
    write_document(out, found)
    typer.echo(f"{place_in_words(out)}: {found.explanation}", err=True)

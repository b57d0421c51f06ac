"""Command `mrbench trial`."""

import shlex
from pathlib import Path
from typing import Annotated

import typer


def trial(
    out: Annotated[
        Path, typer.Option(help="File for the result; the cases are in a folder of the same name next to it.")
    ],
    cases: Annotated[int, typer.Option(min=1, max=999, help="Number of cases.")] = 230,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the random draw.")] = 1,
    workers: Annotated[int, typer.Option(min=1, max=64, help="Number of parallel cases.")] = 1,
    wired: Annotated[
        int,
        typer.Option(
            "--wired", "--over-wires", metavar="K", min=0, help="Record the first K cases again over wires."
        ),
    ] = 0,
    grid: Annotated[
        bool, typer.Option("--grid", help="Single effects over a grid of sizes, for a detection curve.")
    ] = False,
    diagnose: Annotated[
        str | None,
        typer.Option(
            metavar="COMMAND", help="Another command to diagnose with; LOG --out FILE --twin FILE are appended."
        ),
    ] = None,
) -> None:
    """Test the diagnosis on scenarios whose truth is sealed.

    The effects have other forms than in the library. A trial that was killed continues.
    """
    from sim_rig.trial.cases import TrialFolder
    from sim_rig.trial.execution import DIAGNOSE, TrialOptions, prepare_truth, run_cases
    from sim_rig.trial.progress import show_progress_bars
    from sim_rig.trial.scoring import render_table, score_trial

    folder = TrialFolder(out)
    command = tuple(shlex.split(diagnose)) if diagnose else DIAGNOSE
    options = TrialOptions(cases, seed, "grid" if grid else "blind", workers, min(wired, cases), command)
    with show_progress_bars() as progress:
        seal, truth = prepare_truth(folder, options, progress)
        typer.echo(f"sealed: SHA-256 {seal.sha256} of {folder.truth}", err=True)
        run_cases(folder, truth, options, progress)
    report = score_trial(folder, options)
    folder.write_file(out, report.model_dump_json(by_alias=True, indent=2) + "\n")
    typer.echo(render_table(report), nl=False)

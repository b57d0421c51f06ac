"""The command `mrbench trial`."""

import shlex
from pathlib import Path
from typing import Annotated

import typer


def trial(
    out: Annotated[Path, typer.Option(help="The answer; the cases stand beside it, in a folder of that name.")],
    cases: Annotated[int, typer.Option(min=1, max=999, help="How many.")] = 230,
    seed: Annotated[int, typer.Option(min=0, help="Of the draw.")] = 1,
    workers: Annotated[int, typer.Option(min=1, max=64, help="Cases at the same time.")] = 1,
    over_wires: Annotated[
        int, typer.Option(metavar="K", min=0, help="The first K cases once more over wires, in real time.")
    ] = 0,
    grid: Annotated[
        bool, typer.Option("--grid", help="Single effects over a grid of sizes, for a detection curve.")
    ] = False,
    diagnose: Annotated[
        str | None,
        typer.Option(metavar="COMMAND", help="Another diagnosis: LOG --out FILE --twin FILE follow it."),
    ] = None,
) -> None:
    """Try the diagnosis on sealed scenarios, whose effects have forms of their own; a killed trial goes on."""
    from sim_rig.trial.folder import TrialFolder
    from sim_rig.trial.run import DIAGNOSE, Plan, run_cases, sealed_truth
    from sim_rig.trial.show import progress_bars
    from sim_rig.trial.table import table
    from sim_rig.trial.whole import answer

    folder = TrialFolder(out)
    command = tuple(shlex.split(diagnose)) if diagnose else DIAGNOSE
    plan = Plan(cases, seed, "grid" if grid else "blind", workers, min(over_wires, cases), command)
    with progress_bars() as progress:
        seal, truth = sealed_truth(folder, plan, progress)
        typer.echo(f"sealed: SHA-256 {seal.sha256} of {folder.truth}", err=True)
        run_cases(folder, truth, plan, progress)
    found = answer(folder, plan)
    folder.put(out, found.model_dump_json(by_alias=True, indent=2) + "\n")
    typer.echo(table(found), nl=False)

"""``mrbench prepare``: setup steps before a run."""

from pathlib import Path
from typing import Annotated, cast, get_args

import typer

from bench.setup_steps import SetupStep

_STEPS = ", ".join(get_args(SetupStep))


def prepare(
    step: Annotated[str, typer.Argument(metavar="STEP", help=f"One of: {_STEPS}.")],
    to: Annotated[
        float | None,
        typer.Option(
            "--to",
            metavar="METRES",
            help="Target of `move` [m], relative to the specimen's centre, or to home before `centre`.",
        ),
    ] = None,
    config: Annotated[Path, typer.Option(metavar="FILE", help="Configuration of the bench.")] = Path("bench.toml"),
) -> None:
    """Execute a setup step before a run, such as home or tare.

    The rig agent that is running executes it (`mrbench rig` or `mrbench serve`).

    home finds the reference and moves to the middle of the travel; it is refused while a specimen is clamped. move
    moves the rod to --to. mount and unmount record that a specimen has been clamped or unclamped. centre makes the
    present position the zero of positions. tare subtracts the present force from now on, clear-tare ends that.
    Ctrl-C stops the rod.
    """
    from bench.agent_protocol import request_setup_step

    if step not in get_args(SetupStep):
        raise typer.BadParameter(f"unknown step {step}; the steps are {_STEPS}")
    if step == "move" and to is None:
        raise typer.BadParameter("move needs a target position: --to METRES")
    if step != "move" and to is not None:
        raise typer.BadParameter(f"--to is the target of move; {step} takes no position")
    typer.echo(request_setup_step(config, cast(SetupStep, step), to))

"""``mrbench prepare``: what a technician does before a run."""

from pathlib import Path
from typing import Annotated, cast, get_args

import typer

from bench.agent.steps import Step

_STEPS = ", ".join(get_args(Step))


def prepare(
    step: Annotated[str, typer.Argument(metavar="STEP", help=f"One of: {_STEPS}.")],
    to: Annotated[
        float | None,
        typer.Option(
            "--to",
            metavar="METRES",
            help="Where `move` goes [m], from the specimen's middle, or from home before there is one.",
        ),
    ] = None,
    config: Annotated[Path, typer.Option(metavar="FILE", help="The bench whose agent is asked.")] = Path(
        "bench.toml"
    ),
) -> None:
    """Do what comes before a run: home, move, clamp, centre, tare.

    The agent that runs (`mrbench rig` or `mrbench serve`) does it.

    home seeks the reference and goes to the middle of the travel; it is refused with a specimen clamped. move goes
    where --to says. mount and unmount say that a specimen has been clamped or unclamped. centre makes the place
    where the rod stands the zero of positions. tare takes the present force off, clear-tare does so no more.
    Ctrl-C brings the rod to rest.
    """
    from bench.agent.prepare import prepare_through_agent

    if step not in get_args(Step):
        raise typer.BadParameter(f"there is no step {step}; there are {_STEPS}")
    if step == "move" and to is None:
        raise typer.BadParameter("say where the rod is to go: --to METRES")
    if step != "move" and to is not None:
        raise typer.BadParameter(f"--to says where move goes; {step} takes none")
    typer.echo(prepare_through_agent(config, cast(Step, step), to))

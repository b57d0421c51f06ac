"""Command line of the simulated rig: ``python -m sim_rig``."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from sim_rig.commands import sim
from sim_rig.errors import SimRigError
from sim_rig.scenario import load_scenario

app = typer.Typer(
    add_completion=False, no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode=None
)


@app.callback()
def _rig() -> None:
    """Simulate a damper with its actuator and sensors."""


@app.command()
def play(
    scenario: Annotated[str, typer.Option(help="Name of a shipped scenario, or a file.")],
    commands: Annotated[Path, typer.Option(help="Commands: npz with time, displacement, drive.")],
    out: Annotated[Path, typer.Option(help="Recorded channels: npz.")],
    seed: Annotated[int | None, typer.Option(min=0, help="Replaces the seed of the scenario.")] = None,
    temperature: Annotated[
        float | None, typer.Option(help="Temperature of the damper at the start [degC]; else that of the room.")
    ] = None,
    truth: Annotated[Path | None, typer.Option(help="Also write the hidden truth, for tests only: npz.")] = None,
) -> None:
    """Play commands from a file, faster than real time."""
    from sim_rig import offline_run

    loaded = load_scenario(scenario)
    if seed is not None:
        loaded = loaded.model_copy(update={"seed": seed})
    result = offline_run.run_offline(loaded, offline_run.read_commands(commands), _print_progress, temperature)
    offline_run.write_channels(out, loaded, result)
    if truth is not None:
        offline_run.write_truth(truth, loaded, result)


app.command("serve")(sim)


def _print_progress(fraction: float) -> None:
    typer.echo(json.dumps({"progress": round(fraction, 4)}), err=True)


def main() -> None:
    """Run one command; exit with 1 and one line for an error, with 2 for misuse."""
    try:
        app(prog_name="python -m sim_rig")
    except (SimRigError, OSError) as error:
        typer.echo(f"sim_rig: {error}", err=True)
        sys.exit(1)


if __name__ == "__main__":
    main()

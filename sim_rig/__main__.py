"""The rig's own command line: ``python -m sim_rig``."""

import json
import sys
from pathlib import Path
from typing import Annotated, Literal

import typer

from sim_rig.commands import sim
from sim_rig.errors import SimRigError
from sim_rig.scenario import load_scenario, scenario_schema

app = typer.Typer(
    add_completion=False, no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode=None
)


@app.callback()
def _rig() -> None:
    """The simulated rig: plays a damper with its actuator and sensors."""


@app.command()
def play(
    scenario: Annotated[str, typer.Option(help="Name of a shipped scenario, or a file.")],
    commands: Annotated[Path, typer.Option(help="Commands: npz with time, displacement, drive.")],
    out: Annotated[Path, typer.Option(help="Channels as recorded: npz.")],
    seed: Annotated[int | None, typer.Option(min=0, help="In place of the scenario's own.")] = None,
    truth: Annotated[Path | None, typer.Option(help="Also the hidden truth, for tests only: npz.")] = None,
) -> None:
    """Play commands from a file, faster than real time."""
    from sim_rig import play as playing  # the compiler is loaded only where something is to be played

    chosen = load_scenario(scenario)
    if seed is not None:
        chosen = chosen.model_copy(update={"seed": seed})
    played = playing.play(chosen, playing.read_commands(commands), _say)
    playing.write_channels(out, chosen, played)
    if truth is not None:
        playing.write_truth(truth, chosen, played)


app.command("serve")(sim)


@app.command()
def schema(
    document: Annotated[Literal["scenario", "trial"], typer.Argument(help="Which document.")] = "scenario",
) -> None:
    """Print the JSON Schema of a document."""
    from sim_rig.trial.answer import trial_schema

    typer.echo(trial_schema() if document == "trial" else scenario_schema(), nl=False)


def _say(done: float) -> None:
    typer.echo(json.dumps({"progress": round(done, 4)}), err=True)


def main() -> None:
    """Run one command; exit 1 with one line on what could not be done, 2 on misuse."""
    try:
        app(prog_name="python -m sim_rig")
    except (SimRigError, OSError) as error:
        typer.echo(f"sim_rig: {error}", err=True)
        sys.exit(1)


if __name__ == "__main__":
    main()

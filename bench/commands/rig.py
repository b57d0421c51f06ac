"""`mrbench rig`: the rig agent as a process."""

from pathlib import Path
from typing import Annotated

import typer


def rig(
    config: Annotated[
        Path, typer.Option(metavar="FILE", help="Configuration: instruments and their addresses.")
    ] = Path("bench.toml"),
    commands: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="ZeroMQ address for commands, instead of the configured.")
    ] = None,
    samples: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="ZeroMQ address for published samples, instead of the configured."),
    ] = None,
) -> None:
    """Control the instruments of a bench, and execute the commands of `mrbench prepare` and of the service.

    Runs until Ctrl-C or SIGTERM.
    """
    from bench.agent import serve_agent

    serve_agent(config, commands, samples, lambda line: typer.echo(line), lambda line: typer.echo(line, err=True))

"""`mrbench rig`: the rig agent as a process of its own."""

from pathlib import Path
from typing import Annotated

import typer


def rig(
    config: Annotated[
        Path, typer.Option(metavar="FILE", help="Which instruments there are, and how they are reached.")
    ] = Path("bench.toml"),
    commands: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="ZeroMQ address for commands, else as configured.")
    ] = None,
    samples: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="ZeroMQ address that publishes, else as configured.")
    ] = None,
) -> None:
    """Own the instruments of a bench and do what others ask of it.

    Until Ctrl-C or SIGTERM; others are `mrbench prepare` and the service.
    """
    from bench.agent.serve import serve_agent

    serve_agent(config, commands, samples, lambda line: typer.echo(line), lambda line: typer.echo(line, err=True))

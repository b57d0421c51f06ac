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
        typer.Option(metavar="ADDRESS", help="ZeroMQ address for published samples; by default the next port."),
    ] = None,
    end: Annotated[
        bool,
        typer.Option("--end", help="End the running agent of this bench if it is idle; a service starts another."),
    ] = False,
    force: Annotated[
        bool, typer.Option("--force", help="With --end: also end a tripped agent, which forgets the trip.")
    ] = False,
) -> None:
    """Run the rig agent, which controls the instruments of a bench.

    It executes the commands of `mrbench prepare` and of the service. Runs until Ctrl-C or SIGTERM. With --end, it
    ends the agent that runs.
    """
    if force and not end:
        raise typer.BadParameter("--force needs --end")
    if end:
        from bench.agent_protocol import request_end

        return typer.echo(request_end(config, force=force))
    from bench.agent import serve_agent

    return serve_agent(
        config, commands, samples, lambda line: typer.echo(line), lambda line: typer.echo(line, err=True)
    )

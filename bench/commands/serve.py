"""``mrbench serve``: the service with its page."""

from pathlib import Path
from typing import Annotated

import typer


def serve(
    config: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="bench.toml of the rig; an agent is started with it where none answers."
        ),
    ] = None,
    host: Annotated[
        str, typer.Option(metavar="HOST", help="Address to listen at; beyond loopback, put TLS in front.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port to listen at; 0 takes a free one.")] = 8600,
    data: Annotated[Path, typer.Option(metavar="DIR", help="Where logs, results and catalogue lie.")] = Path(
        "runs"
    ),
    agent: Annotated[
        str | None,
        typer.Option(
            metavar="tcp://HOST:PORT", help="A rig agent that runs already; it publishes at the next port."
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="tcp://HOST:PORT", help="A dask scheduler with workers of its own, instead of one here."
        ),
    ] = None,
    new_token: Annotated[
        bool, typer.Option("--new-token", help="Make another token; the old one opens nothing any more.")
    ] = False,
) -> None:
    """Serve REST interface, live values and page.

    Starts a rig agent and one worker, unless told where they are. Prints the page's address, its token once.
    """
    from bench.service.serving import Wanted
    from bench.service.serving import serve as serve_until_told_to_end

    wanted = Wanted(data, host, port, config, agent, scheduler, new_token)
    serve_until_told_to_end(wanted, lambda line: typer.echo(line))

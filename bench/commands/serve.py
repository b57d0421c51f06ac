"""``mrbench serve``: the service with its web page."""

from pathlib import Path
from typing import Annotated

import typer


def serve(
    config: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="bench.toml of the rig; if no rig agent replies, one is started with it."
        ),
    ] = None,
    host: Annotated[
        str, typer.Option(metavar="HOST", help="Address to listen on; use a TLS proxy for other than loopback.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port to listen on; 0 chooses a free one.")] = 8600,
    data: Annotated[Path, typer.Option(metavar="DIR", help="Data folder: logs, results and catalogue.")] = Path(
        "runs"
    ),
    agent: Annotated[
        str | None,
        typer.Option(
            metavar="tcp://HOST:PORT",
            help="Command address of a running rig agent; its samples are published at the next port.",
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="tcp://HOST:PORT", help="Dask scheduler with workers, instead of starting one here."),
    ] = None,
    new_token: Annotated[
        bool, typer.Option("--new-token", help="Create a new token; the old one becomes invalid.")
    ] = False,
) -> None:
    """Serve the REST interface, the live values and the web page.

    Starts a rig agent and one worker, unless their addresses are given. Prints the page's address, and the token
    when it is new.
    """
    from bench.service import ServeOptions
    from bench.service import serve as run_service

    run_service(ServeOptions(data, host, port, config, agent, scheduler, new_token), lambda line: typer.echo(line))

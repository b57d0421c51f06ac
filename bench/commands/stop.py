"""``mrbench stop``: end of what is in progress on the local bench."""

from pathlib import Path
from typing import Annotated

import typer


def stop(
    abort: Annotated[
        bool,
        typer.Option("--abort", help="Stop coil and actuator at once, as a trip does; it latches until a reset."),
    ] = False,
    config: Annotated[Path, typer.Option(metavar="FILE", help="Configuration of the bench.")] = Path("bench.toml"),
) -> None:
    """Stop the run or the setup step of the local bench.

    The motion fades out and the coil goes to zero. Works while the service is down, and also ends `mrbench run`.
    It is no emergency stop: that is a switch of the rig.
    """
    from bench.agent_protocol import request_stop

    typer.echo(request_stop(config, abort=abort))

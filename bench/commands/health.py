"""``mrbench health``: whether the parts of a bench answer."""

from pathlib import Path
from typing import Annotated, cast, get_args

import typer

from bench.health import Part

_PARTS = ", ".join(get_args(Part))


def health(
    part: Annotated[str, typer.Argument(metavar="PART", help=f"One of: {_PARTS}.")],
    config: Annotated[Path, typer.Option(metavar="FILE", help="Configuration of the bench.")] = Path("bench.toml"),
    data: Annotated[Path, typer.Option(metavar="DIR", help="Data folder of the service.")] = Path("runs"),
    url: Annotated[str, typer.Option(metavar="URL", help="Address of the service.")] = "http://127.0.0.1:8600",
) -> None:
    """Check that a part of a bench answers at its socket.

    Exits with status 0, or with 1 and the reason. Meant for supervisors such as containers. instruments connects
    to the TCP addresses of bench.toml. It is for simulated ones, because a real instrument may accept one host
    only.
    """
    from bench.health import check_part

    if part not in get_args(Part):
        raise typer.BadParameter(f"unknown part {part}; the parts are {_PARTS}")
    typer.echo(f"{part}: {check_part(cast(Part, part), config, data, url)}")

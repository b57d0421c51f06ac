"""``mrbench import``: recordings made elsewhere become a log."""

from pathlib import Path
from typing import Annotated

import typer


def import_csv(
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE", help="CSV files, plain or .gz; each is a stretch of its own.")
    ],
    out: Annotated[Path, typer.Option(metavar="LOG", help="The log to write.")],
    column: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=HEADER", help="The file's own header for one of our columns; once for each."),
    ] = None,
    drive_kind: Annotated[
        str | None,
        typer.Option(
            metavar="KIND", help="driver_command_v (taken for volts), coil_v or coil_a (taken for ampere)."
        ),
    ] = None,
    specimen: Annotated[str, typer.Option(metavar="NAME", help="The damper, with its serial number.")] = "unknown",
) -> None:
    """Turn recordings made elsewhere into a log.

    Columns: time_s, displacement_m, force_n, one of voltage_v or current_a, and if there velocity_mps and
    temperature_c, in SI units; displacement positive where the damper extends, force positive in tension.
    Segments are found where drive, amplitude or frequency change.
    """
    from bench.recorder.csv_file import DRIVE_KINDS, NAMES
    from bench.recorder.importing import import_recordings

    headers: dict[str, str] = {}
    for pair in column or []:
        name, equals, header = pair.partition("=")
        if name not in NAMES or not equals or not header:
            raise typer.BadParameter(f"{pair!r} is not NAME=HEADER with NAME one of {', '.join(NAMES)}")
        headers[name] = header
    if drive_kind is not None and drive_kind not in DRIVE_KINDS:
        raise typer.BadParameter(f"{drive_kind!r} is not one of {', '.join(DRIVE_KINDS)}")
    summary = import_recordings(files, out, headers, drive_kind, specimen)
    typer.echo(f"{out}: {summary}", err=True)

"""``mrbench import``: a log from recordings of another test bench."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer


def import_csv(
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE", help="CSV files, plain or .gz; each becomes one stretch.")
    ],
    out: Annotated[Path, typer.Option(metavar="LOG", help="Log to write.")],
    column: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=HEADER", help="Header in the file for column NAME; may be given repeatedly."),
    ] = None,
    drive_kind: Annotated[
        str | None,
        typer.Option(
            metavar="KIND",
            help="driver_command_v (default for volts), coil_v or coil_a (default for amperes).",
        ),
    ] = None,
    unit: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=UNIT",
            help="Unit of column NAME in the file, such as mm, kN or ms; may be given repeatedly.",
        ),
    ] = None,
    reverse: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Column recorded in the opposite sense; may be given repeatedly."),
    ] = None,
    specimen: Annotated[
        str, typer.Option(metavar="NAME", help="Damper under test, with its serial number.")
    ] = "unknown",
) -> None:
    """Write recordings of another test bench to a log.

    Columns, in SI units: time_s, displacement_m, force_n, one of voltage_v or current_a, and optionally
    velocity_mps and temperature_c. Displacement is positive in extension, force in tension. Other headers, units
    and senses are converted with --column, --unit and --reverse. A new segment begins where drive, amplitude or
    frequency change.
    """
    from bench.csv_import import COLUMN_NAMES, DRIVE_KINDS, import_recordings

    headers = _parse_pairs(column or [], "HEADER", COLUMN_NAMES)
    units = _parse_pairs(unit or [], "UNIT", COLUMN_NAMES)
    if drive_kind is not None and drive_kind not in DRIVE_KINDS:
        raise typer.BadParameter(f"{drive_kind!r} is not one of {', '.join(DRIVE_KINDS)}")
    summary = import_recordings(
        files, out, headers, drive_kind, specimen, units=units, reversed_columns=reverse or []
    )
    typer.echo(f"{out}: {summary}", err=True)


def _parse_pairs(pairs: Sequence[str], kind: str, names: Sequence[str]) -> dict[str, str]:
    """Return the values of NAME=VALUE by name; ``kind`` describes the value."""
    found: dict[str, str] = {}
    for pair in pairs:
        name, equals, value = pair.partition("=")
        if name not in names or not equals or not value:
            raise typer.BadParameter(f"{pair!r} is not NAME={kind} with NAME one of {', '.join(names)}")
        found[name] = value
    return found

"""Command `mrbench sim`: the simulated rig on its wires."""

from pathlib import Path
from typing import Annotated, Literal

import typer


def sim(
    scenario: Annotated[
        str, typer.Option(metavar="NAME|FILE", help="Name of a shipped scenario, or a file.")
    ] = "default",
    out: Annotated[
        Path, typer.Option(metavar="FILE", help="File for the configuration that reaches the rig.")
    ] = Path("bench.toml"),
    speed: Annotated[float, typer.Option(min=0.01, max=50.0, help="Speed of the rig over real time.")] = 1.0,
    lvdt: Annotated[Literal["tcp", "rtu"], typer.Option(help="Modbus TCP, or RTU on a pty.")] = "tcp",
    load_cell: Annotated[
        Literal["pty", "tcp", "ascii"],
        typer.Option(help="Framed stream on a pty or a TCP socket, or lines of text on a pty."),
    ] = "pty",
    faults: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Faults of the wires: JSON, by instrument.")
    ] = None,
) -> None:
    """Run the simulated rig, every instrument on its own wire.

    It runs until Ctrl-C or SIGTERM. Meanwhile `bench.toml` contains the address of each instrument.
    """
    from sim_rig.protocols import load_wire_faults
    from sim_rig.scenario import load_scenario
    from sim_rig.server import ServerSettings, TransportOptions, run_until_stopped

    settings = ServerSettings(TransportOptions(lvdt, load_cell), load_wire_faults(faults) if faults else {}, speed)
    run_until_stopped(load_scenario(scenario), out, settings)

"""The rig's command of `mrbench`."""

from pathlib import Path
from typing import Annotated, Literal

import typer


def sim(
    scenario: Annotated[
        str, typer.Option(metavar="NAME|FILE", help="Name of a shipped scenario, or a file.")
    ] = "default",
    out: Annotated[
        Path, typer.Option(metavar="FILE", help="Where to write the configuration that reaches the rig.")
    ] = Path("bench.toml"),
    speed: Annotated[
        float, typer.Option(min=0.01, max=50.0, help="How many times as fast as real time the rig runs.")
    ] = 1.0,
    lvdt: Annotated[Literal["tcp", "rtu"], typer.Option(help="Modbus TCP, or RTU on a pty.")] = "tcp",
    load_cell: Annotated[
        Literal["pty", "tcp", "ascii"],
        typer.Option(help="Framed stream on a pty or a TCP socket, or lines of text on a pty."),
    ] = "pty",
    faults: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Faults on the wires: JSON, by instrument.")
    ] = None,
) -> None:
    """Run the simulated rig, every instrument on its own wire.

    Until Ctrl-C or SIGTERM; `bench.toml` says meanwhile where each instrument is reached.
    """
    from sim_rig.faults import load_wire_faults
    from sim_rig.scenario import load_scenario
    from sim_rig.serve import Choices
    from sim_rig.sim_process import Settings, run_until_stopped

    settings = Settings(Choices(lvdt, load_cell), load_wire_faults(faults) if faults else {}, speed)
    run_until_stopped(load_scenario(scenario), out, settings)

"""Command `mrbench sim`: the simulated rig on its wires."""

from pathlib import Path
from typing import Annotated, Literal

import typer


def sim(
    scenario: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE", help="Name of a shipped scenario, or a file; without it the default rig."
        ),
    ] = None,
    draw: Annotated[
        int | None,
        typer.Option(
            metavar="SEED", min=0, help="Instead of a scenario: a damper with a hidden effect, drawn by this seed."
        ),
    ] = None,
    truth: Annotated[
        Path | None, typer.Option(metavar="FILE", help="File for the truth of --draw; nothing else contains it.")
    ] = None,
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
    if draw is None and truth is not None:
        raise typer.BadParameter("--truth is the file for the truth of a drawn damper; add --draw SEED")
    if draw is not None and truth is None:
        raise typer.BadParameter("--draw hides the effect, so its truth needs a file; add --truth FILE")
    if draw is not None and scenario is not None:
        raise typer.BadParameter("--draw and --scenario both choose the damper; leave one of them out")
    from sim_rig.hidden_effect import draw_scenario, make_truth, write_truth
    from sim_rig.protocols import load_wire_faults
    from sim_rig.scenario import load_scenario
    from sim_rig.server import ServerSettings, TransportOptions, run_until_stopped

    settings = ServerSettings(TransportOptions(lvdt, load_cell), load_wire_faults(faults) if faults else {}, speed)
    if draw is None or truth is None:
        played = load_scenario(scenario or "default")
    else:
        played = draw_scenario(draw)
        write_truth(truth, make_truth(played))
        typer.echo(
            f"{truth}: the hidden effect of seed {draw}; nothing else that the rig writes or prints names it"
        )
    run_until_stopped(played, out, settings)

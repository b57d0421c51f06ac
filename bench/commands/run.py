"""`mrbench run`: one method, once."""

from pathlib import Path
from typing import Annotated

import typer


def run(
    method: Annotated[str, typer.Argument(help="A shipped method by its name, or a file.", metavar="METHOD")],
    scenario: Annotated[
        str | None,
        typer.Option(metavar="NAME|FILE", help="What the simulated plant plays: a shipped scenario or a file."),
    ] = None,
    config: Annotated[
        Path | None, typer.Option(metavar="FILE", help="bench.toml: runs on the instruments that it names.")
    ] = None,
    out: Annotated[str, typer.Option(metavar="LOG", help="The log; with --dry-run, - prints JSON.")] = "run.mcap",
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Only say what the method will ask for, and what it can tell.")
    ] = False,
    model: Annotated[
        Path | None,
        typer.Option(metavar="FIT", help="With --dry-run: a fit, twin or scenario of the damper to expect."),
    ] = None,
    planned: Annotated[
        Path | None, typer.Option(metavar="FILE.npz", help="With --dry-run: write the exact samples there.")
    ] = None,
    specimen: Annotated[str, typer.Option(metavar="NAME", help="Name of the damper under test.")] = "",
    operator: Annotated[str, typer.Option(metavar="NAME", help="Who runs it.")] = "",
    seed: Annotated[
        int | None, typer.Option(help="Of everything that chance decides on the simulated rig.")
    ] = None,
) -> None:
    """Run a method once and record it.

    On the instruments of --config, with an agent of its own; or with --scenario from the simulated plant, without
    wires and faster than real time.
    """
    if dry_run and planned is not None:
        return _write_samples(method, planned)
    if dry_run:
        return _show_envelope(method, model, as_json=out == "-")
    if model is not None or planned is not None:
        raise typer.BadParameter("--model and --planned are for strokes that are only planned: with --dry-run")
    if (scenario is None) == (config is None):
        raise typer.BadParameter(
            "say what to run it on: --config bench.toml, --scenario NAME or FILE, or --dry-run"
        )
    if out == "-":
        raise typer.BadParameter("a log goes to a file: --out run.mcap")
    if config is not None:
        if seed is not None:
            raise typer.BadParameter("--seed is for the simulated plant: with --scenario")
        return _record_on_rig(method, config, Path(out), specimen, operator)
    return _record(method, str(scenario), Path(out), specimen, operator, seed)


def _show_envelope(name: str, model: Path | None, *, as_json: bool) -> None:
    from bench.errors import RunError
    from bench.foresee import foreseen
    from bench.methods import compile_method, load_method
    from bench.methods.envelope import envelope, envelope_lines

    programme = compile_method(load_method(name))
    found = envelope(programme)
    try:
        found = found.model_copy(update={"foreseen": foreseen(programme, model)})
    except RunError as error:
        if model is not None:
            raise
        # A bench without the identification still tells what the machine will be asked.
        typer.echo(f"mrbench: {error}", err=True)
    if as_json:
        typer.echo(found.model_dump_json(by_alias=True, indent=2))
    else:
        typer.echo("\n".join([*envelope_lines(found), *(found.foreseen or {}).get("words", ())]))


def _write_samples(name: str, path: Path) -> None:
    from bench.foresee import write_planned
    from bench.methods import compile_method, load_method

    write_planned(path, compile_method(load_method(name)))
    typer.echo(f"{path}: planned strokes", err=True)


def _record(name: str, scenario: str, out: Path, specimen: str, operator: str, seed: int | None) -> None:
    from datetime import UTC, datetime

    from bench.methods import load_method
    from bench.progress import progress_bar
    from bench.run_from_plant import Identity, run_from_plant

    method = load_method(name)
    identity = Identity(specimen, operator, datetime.now(UTC))
    with progress_bar(method.name) as progress:
        programme = run_from_plant(method, scenario, out, identity, progress, seed=seed)
    segments, duration = len(programme.segments), programme.duration
    typer.echo(f"{out}: {segments} segments, {duration:.1f} s, {len(programme.time)} samples", err=True)


def _record_on_rig(name: str, config: Path, out: Path, specimen: str, operator: str) -> None:
    from bench.methods import load_method
    from bench.progress import progress_bar
    from bench.run_on_rig import run_on_rig

    method = load_method(name)
    with progress_bar(method.name) as progress:
        ended = run_on_rig(
            method, config, out, specimen, operator, progress, lambda warning: typer.echo(warning, err=True)
        )
    lost = "".join(f", {count} samples of {channel} lost" for channel, count in ended.lost.items())
    typer.echo(f"{out}: {ended.outcome}, {ended.duration_s:.1f} s{lost}", err=True)

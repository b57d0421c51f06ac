"""`mrbench run`: execution of a method, or its dry run."""

from pathlib import Path
from typing import Annotated

import typer


def run(
    method: Annotated[str, typer.Argument(help="Name of a shipped method, or a file.", metavar="METHOD")],
    scenario: Annotated[
        str | None,
        typer.Option(metavar="NAME|FILE", help="Run on the simulated plant: a shipped scenario or a file."),
    ] = None,
    config: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Run on the instruments of this bench.toml.")
    ] = None,
    out: Annotated[
        str, typer.Option(metavar="LOG", help="Log to write; with --dry-run, - prints JSON.")
    ] = "run.mcap",
    dry_run: Annotated[
        bool,
        typer.Option("--dry-run", help="Only show the peaks of the method and which parameters it can determine."),
    ] = False,
    model: Annotated[
        Path | None,
        typer.Option(metavar="FIT", help="With --dry-run: fit, twin or scenario of the expected damper."),
    ] = None,
    planned: Annotated[
        Path | None, typer.Option(metavar="FILE.npz", help="With --dry-run: write the exact samples to this file.")
    ] = None,
    specimen: Annotated[str, typer.Option(metavar="NAME", help="Name of the damper under test.")] = "",
    operator: Annotated[str, typer.Option(metavar="NAME", help="Name of the operator.")] = "",
    seed: Annotated[int | None, typer.Option(help="Seed of all random values of the simulated rig.")] = None,
) -> None:
    """Run a method once and record it.

    With --config on the instruments, by a rig agent in this process. With --scenario on the simulated plant,
    without wires and faster than real time.
    """
    if dry_run and planned is not None:
        return _write_samples(method, planned)
    if dry_run:
        return _show_envelope(method, model, as_json=out == "-")
    if model is not None or planned is not None:
        raise typer.BadParameter("--model and --planned need --dry-run")
    if (scenario is None) == (config is None):
        raise typer.BadParameter("give one of --config bench.toml, --scenario NAME or FILE, and --dry-run")
    if out == "-":
        raise typer.BadParameter("a log cannot be printed; give a file: --out run.mcap")
    if config is not None:
        if seed is not None:
            raise typer.BadParameter("--seed needs the simulated plant: --scenario")
        return _record_on_rig(method, config, Path(out), specimen, operator)
    return _record(method, str(scenario), Path(out), specimen, operator, seed)


def _show_envelope(name: str, model: Path | None, *, as_json: bool) -> None:
    from bench.errors import RunError
    from bench.methods import compile_method, compute_envelope, format_envelope, load_method
    from bench.runs import assess_design

    programme = compile_method(load_method(name))
    envelope = compute_envelope(programme)
    try:
        envelope = envelope.model_copy(update={"design": assess_design(programme, model)})
    except RunError as error:
        if model is not None:
            raise
        # A bench without the identification package can still show the peaks.
        typer.echo(f"mrbench: {error}", err=True)
    if as_json:
        typer.echo(envelope.model_dump_json(by_alias=True, indent=2))
    else:
        typer.echo("\n".join([*format_envelope(envelope), *(envelope.design or {}).get("messages", ())]))


def _write_samples(name: str, path: Path) -> None:
    from bench.methods import compile_method, load_method
    from bench.runs import write_planned_strokes

    write_planned_strokes(path, compile_method(load_method(name)))
    typer.echo(f"{path}: planned strokes", err=True)


def _record(name: str, scenario: str, out: Path, specimen: str, operator: str, seed: int | None) -> None:
    from datetime import UTC, datetime

    from bench.log import Identity
    from bench.methods import load_method
    from bench.progress import show_progress
    from bench.runs import run_from_plant

    method = load_method(name)
    identity = Identity(specimen, operator, datetime.now(UTC))
    with show_progress(method.name) as progress:
        programme = run_from_plant(method, scenario, out, identity, progress, seed=seed)
    segments, duration = len(programme.segments), programme.duration
    typer.echo(f"{out}: {segments} segments, {duration:.1f} s, {len(programme.time)} samples", err=True)


def _record_on_rig(name: str, config: Path, out: Path, specimen: str, operator: str) -> None:
    from bench.methods import load_method
    from bench.progress import show_progress
    from bench.runs import run_on_rig

    method = load_method(name)
    with show_progress(method.name) as progress:
        status = run_on_rig(
            method, config, out, specimen, operator, progress, lambda warning: typer.echo(warning, err=True)
        )
    lost = "".join(f", {count} samples of {channel} lost" for channel, count in status.lost.items())
    typer.echo(f"{out}: {status.outcome}, {status.duration_s:.1f} s{lost}", err=True)

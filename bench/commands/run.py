"""`mrbench run`: one method, once."""

from pathlib import Path
from typing import Annotated

import typer


def run(
    method: Annotated[str, typer.Argument(help="A shipped method by its name, or a file.", metavar="METHOD")],
    scenario: Annotated[
        str | None, typer.Option(help="What the simulated plant plays: a shipped scenario or a file.")
    ] = None,
    config: Annotated[Path | None, typer.Option(help="bench.toml: runs on the instruments that it names.")] = None,
    out: Annotated[str, typer.Option(help="The log; with --dry-run, - prints JSON.")] = "run.mcap",
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only say what the method will ask for.")] = False,
    specimen: Annotated[str, typer.Option(help="Name of the damper under test.")] = "",
    operator: Annotated[str, typer.Option(help="Who runs it.")] = "",
    seed: Annotated[
        int | None, typer.Option(help="Of everything that chance decides on the simulated rig.")
    ] = None,
) -> None:
    """Run a method once and record it; with --scenario from the simulated plant, faster than real time."""
    if dry_run:
        return _show_envelope(method, as_json=out == "-")
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


def _show_envelope(name: str, *, as_json: bool) -> None:
    from bench.methods import compile_method, load_method
    from bench.methods.envelope import envelope, envelope_lines

    found = envelope(compile_method(load_method(name)))
    if as_json:
        typer.echo(found.model_dump_json(by_alias=True, indent=2))
    else:
        typer.echo("\n".join(envelope_lines(found)))


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

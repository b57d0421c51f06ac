"""Arguments of `mrbench campaign`, and the choice of the action."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer


class Action(StrEnum):
    """Actions on a campaign."""

    PLAN = "plan"


def campaign(
    action: Annotated[Action, typer.Argument(help="plan: time, heat, disk, limits and identifiability.")],
    target: Annotated[str, typer.Argument(help="File of the campaign.", metavar="FILE")],
    out: Annotated[str, typer.Option(metavar="FILE", help="- prints JSON.")] = "",
    data: Annotated[Path, typer.Option(metavar="DIR", help="Data folder for logs and catalogue.")] = Path("runs"),
    quick: Annotated[
        bool, typer.Option("--quick", help="With plan: leave out what the strokes can identify.")
    ] = False,
) -> None:
    """Plan a campaign: ordered runs with rests and conditions between them."""
    _plan(Path(target), data, quick=quick, as_json=out == "-")


def _plan(path: Path, data: Path, *, quick: bool, as_json: bool) -> None:
    from bench.campaigns import collect_methods, format_plan, load_campaign, plan_campaign
    from bench.disk import RESERVE, find_free_space
    from bench.runs import assess_design

    document = load_campaign(path)
    free = find_free_space(data).free - RESERVE
    methods = collect_methods(document, allow_files=True)
    plan = plan_campaign(document, methods, None if quick else assess_design, free)
    typer.echo(plan.model_dump_json(by_alias=True, indent=2) if as_json else "\n".join(format_plan(plan)))

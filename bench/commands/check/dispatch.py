"""Arguments of `mrbench check`, and the choice of the action."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer


class Action(StrEnum):
    """Actions on checks."""

    LIST = "list"
    SHOW = "show"
    CHART = "chart"
    BASELINE = "baseline"


class Kind(StrEnum):
    """Kinds of checks."""

    ZERO = "zero"
    SHUNT = "shunt"


def check(
    action: Annotated[
        Action,
        typer.Argument(
            help="list: the newest checks. show: the check in a log. chart: control chart of a channel, or the "
            "state of all. baseline: let only later checks count."
        ),
    ],
    target: Annotated[
        str,
        typer.Argument(
            help="File for show, else a channel such as force; list and chart take all by default.",
            metavar="CHANNEL|LOG",
        ),
    ] = "",
    specimen: Annotated[
        str | None,
        typer.Option(metavar="SERIAL", help="Mounted damper; by default that of the channel's latest check."),
    ] = None,
    kind: Annotated[
        Kind,
        typer.Option(
            "--check",
            help="With list, chart and baseline. zero: mean at rest. shunt: change of the force by the shunt of "
            "the load cell.",
        ),
    ] = Kind.ZERO,
    reason: Annotated[str, typer.Option(metavar="TEXT", help="With baseline: reason, for people.")] = "",
    data: Annotated[Path, typer.Option(metavar="DIR", help="Data folder of the service.")] = Path("runs"),
    operator: Annotated[str, typer.Option(metavar="NAME", help="Person, for the record.")] = "",
    bench: Annotated[
        str, typer.Option(metavar="NAME", help="With chart and baseline: bench, if the service has several.")
    ] = "",
) -> None:
    """Show checks of the channels and their control charts.

    A zero check is a run of the method zero_check, a shunt check one of shunt_check. For a damper driven by
    current they are zero_check_current and shunt_check_current. The service records the checks in its data folder.
    """
    if (action is Action.BASELINE) != bool(reason.strip()):
        raise typer.BadParameter("baseline needs --reason TEXT, and no other action takes it")
    if action in (Action.BASELINE, Action.SHOW) and not target:
        raise typer.BadParameter("baseline needs a CHANNEL, show needs a LOG")
    from bench.commands.audit import record
    from bench.commands.check.actions import begin_baseline, describe_charts, describe_log, list_checks
    from bench.config import choose_bench

    if action is Action.LIST:
        typer.echo("\n".join(list_checks(data, target, kind.value)))
    elif action is Action.CHART:
        lines = describe_charts(data, target, specimen, choose_bench(data, bench), kind.value)
        typer.echo("\n".join(lines))
    elif action is Action.SHOW:
        typer.echo("\n".join(describe_log(Path(target))))
    else:
        author = f"command:{operator}" if operator else "command"
        chosen, why = choose_bench(data, bench), reason.strip()
        typer.echo(begin_baseline(data, target, specimen, author, why, chosen, kind.value))
        record(data, "check baseline", target, {}, {"operator": operator, "reason": why, "check": kind.value})

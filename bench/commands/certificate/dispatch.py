"""Arguments of `mrbench certificate`, and the choice of the action."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer


class Action(StrEnum):
    """Actions on certificates."""

    ADD = "add"
    LIST = "list"
    WITHDRAW = "withdraw"


def certificate(
    action: Annotated[
        Action,
        typer.Argument(
            help="add: store the certificate in a file. list: all with their state. "
            "withdraw: it applies to no later run, and stays in the list."
        ),
    ],
    target: Annotated[
        str, typer.Argument(help="File for add, id for withdraw, none for list.", metavar="FILE|ID")
    ] = "",
    reason: Annotated[str, typer.Option(metavar="TEXT", help="With withdraw: reason, for people.")] = "",
    data: Annotated[Path, typer.Option(metavar="DIR", help="Data folder of the service.")] = Path("runs"),
    operator: Annotated[str, typer.Option(metavar="NAME", help="Person, for the record.")] = "",
    bench: Annotated[
        str, typer.Option(metavar="NAME", help="With add: bench that has the channel, if the service has several.")
    ] = "",
) -> None:
    """Add, list and withdraw calibration certificates.

    The service may run meanwhile. A file holds one document mrbench.certificate/1. A correction is made in the
    page or over REST.
    """
    if (action is Action.LIST) == bool(target):
        raise typer.BadParameter("give a FILE to add or an ID to withdraw; list takes neither")
    if (action is Action.WITHDRAW) != bool(reason.strip()):
        raise typer.BadParameter("withdraw needs --reason TEXT, and no other action takes it")
    from bench.commands.audit import record
    from bench.commands.certificate.actions import add_certificate, list_certificates, withdraw_certificate
    from bench.config import choose_bench

    author = f"command:{operator}" if operator else "command"
    if action is Action.ADD:
        typer.echo(add_certificate(Path(target), data, author, choose_bench(data, bench)))
        record(data, "certificate add", target, {}, {"operator": operator})
    elif action is Action.WITHDRAW:
        typer.echo(withdraw_certificate(target, data, author, reason.strip()))
        record(data, "certificate withdraw", target, {}, {"operator": operator, "reason": reason.strip()})
    else:
        typer.echo("\n".join(list_certificates(data)))

"""``mrbench token``: access for programs."""

from datetime import UTC, datetime, timedelta
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from bench.commands.people.user import RoleName


class TokenAction(StrEnum):
    """Actions on tokens."""

    LIST = "list"
    ADD = "add"
    REVOKE = "revoke"


def token(
    action: Annotated[TokenAction, typer.Argument(help="list; add; revoke.")],
    target: Annotated[
        str, typer.Argument(metavar="LABEL|ID", help="Program and purpose for add; id for revoke.")
    ] = "",
    role: Annotated[RoleName, typer.Option(help="With add: role of the program.")] = RoleName.TECHNICIAN,
    days: Annotated[int, typer.Option(min=1, max=366, help="With add: time until the token ends [days].")] = 30,
    data: Annotated[Path, typer.Option(metavar="DIR", help="Data folder of the service.")] = Path("runs"),
) -> None:
    """Administer the tokens of programs.

    Run it on the machine with the data folder of the service. A new token is printed once; it is stored as a hash.
    A running service takes a change over within two seconds.
    """
    from bench.agent_protocol import get_sender
    from bench.catalogue import open_catalogue
    from bench.commands.audit import record
    from bench.people import new_secret

    if action is not TokenAction.LIST and not target:
        raise typer.BadParameter("give a label for the new token" if action is TokenAction.ADD else "give the id")
    with open_catalogue(data, is_created=True) as catalogue:
        store = catalogue.tokens
        if action is TokenAction.ADD:
            secret, sha256 = new_secret()
            row = store.add(sha256, target, role.value, get_sender().actor, timedelta(days=days))
            record(data, "token add", row.id, {}, {"label": target, "role": role.value, "days": days})
            typer.echo(f"{row.id}: {row.role} until {row.expires:%Y-%m-%d}; this is shown once:", err=True)
            typer.echo(secret)
        elif action is TokenAction.REVOKE:
            _check_id(store.get(target), target)
            store.revoke(target)
            record(data, "token revoke", target, {}, {})
        else:
            for row in store.list_tokens():
                state = "revoked" if row.revoked else "valid" if row.is_valid(datetime.now(UTC)) else "expired"
                typer.echo(f"{row.id}  {state:<8} until {row.expires:%Y-%m-%d}  {row.role:<13}  {row.label}")


def _check_id(found: object, token_id: str) -> None:
    from bench.errors import RunError

    if found is None:
        raise RunError(f"there is no token {token_id}; see: mrbench token list")

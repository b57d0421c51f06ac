"""``mrbench user``: people with a password."""

import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from bench.catalogue import UserRow, UserStore


class UserAction(StrEnum):
    """Actions on users."""

    LIST = "list"
    ADD = "add"
    CHANGE = "change"
    PASSWORD = "password"
    REMOVE = "remove"


class RoleName(StrEnum):
    """Roles; each has the rights of those before it."""

    VIEWER = "viewer"
    TECHNICIAN = "technician"
    ENGINEER = "engineer"
    ADMINISTRATOR = "administrator"


def user(
    action: Annotated[
        UserAction,
        typer.Argument(help="list; add; change (role, full name, disabled); password (set a new one); remove."),
    ],
    name: Annotated[str, typer.Argument(help="Name of the user, such as mcurie.")] = "",
    role: Annotated[RoleName | None, typer.Option(help="With add and change: role.")] = None,
    full_name: Annotated[str | None, typer.Option(metavar="TEXT", help="With add and change: full name.")] = None,
    disabled: Annotated[
        bool | None, typer.Option("--disabled/--enabled", help="With change: whether the user is locked out.")
    ] = None,
    data: Annotated[Path, typer.Option(metavar="DIR", help="Data folder of the service.")] = Path("runs"),
) -> None:
    """Administer the users of a service.

    Run it on the machine with its data folder. A password is asked for on a terminal, or read from the first line
    of the input. A running service takes a change over within two seconds.
    """
    if action is not UserAction.LIST and not name:
        raise typer.BadParameter("give the name of the user")
    if action is UserAction.ADD and role is None:
        raise typer.BadParameter("give the role: --role technician")
    from bench.catalogue import open_catalogue
    from bench.commands.audit import record

    with open_catalogue(data, is_created=True) as catalogue:
        if action is UserAction.LIST:
            _list_users(catalogue.users)
            return
        if action is UserAction.ADD:
            _add(catalogue.users, name, str(role), full_name or "")
        elif action is UserAction.REMOVE:
            _get(catalogue.users, name)
            catalogue.users.remove(name)
            catalogue.sessions.end_all("user", name)
            catalogue.tokens.revoke_all(f"user:{name}")
        else:
            _change(catalogue.users, name, _collect_values(action, name, role, full_name, disabled))
            if action is UserAction.PASSWORD or disabled:
                catalogue.sessions.end_all("user", name)
        new = {"role": role and role.value, "full_name": full_name, "disabled": disabled}
        record(data, f"user {action.value}", name, {}, new)


def _list_users(store: "UserStore") -> None:
    for row in store.list_users():
        without = "no password" if row.external_id is None else "signs in by the provider"
        state = "disabled" if row.disabled else without if row.password_hash is None else ""
        typer.echo("  ".join(filter(None, (f"{row.name:<16}", f"{row.role:<13}", row.full_name, state))))


def _add(store: "UserStore", name: str, role: str, full_name: str) -> None:
    from bench.catalogue import UserRow, check_user_name
    from bench.errors import RunError

    try:
        check_user_name(name)
    except ValueError as error:
        raise RunError(f"{name}: {error}") from None
    row: dict[str, Any] = {"name": name, "role": role, "full_name": full_name, "password_hash": _ask(name)}
    if not store.add(UserRow(**row)):
        raise RunError(f"user {name} exists; change it: mrbench user change {name}")


def _change(store: "UserStore", name: str, values: dict[str, Any]) -> None:
    from bench.errors import RunError

    if _get(store, name).external_id is not None and not values.keys() <= {"disabled"}:
        raise RunError(f"user {name} signs in by the provider; change role, full name and password there")
    store.change(name, values)


def _collect_values(
    action: UserAction, name: str, role: RoleName | None, full_name: str | None, disabled: bool | None
) -> dict[str, Any]:
    if action is UserAction.PASSWORD:
        return {"password_hash": _ask(name)}
    given = {"role": role and role.value, "full_name": full_name, "disabled": disabled}
    values = {column: value for column, value in given.items() if value is not None}
    if not values:
        raise typer.BadParameter("give what to change: --role, --full-name, --disabled or --enabled")
    return values


def _get(store: "UserStore", name: str) -> "UserRow":
    from bench.errors import RunError

    row = store.find(name)
    if row is None:
        raise RunError(f"there is no user {name}; see: mrbench user list")
    return row


def _ask(name: str) -> str:
    """Ask for a new password and return its hash."""
    from bench.errors import RunError
    from bench.people import check_password, hash_password

    if sys.stdin.isatty():
        password = str(typer.prompt(f"password of {name}", hide_input=True, confirmation_prompt=True))
    else:
        password = sys.stdin.readline().rstrip("\n")
    try:
        return hash_password(check_password(password, name))
    except ValueError as error:
        raise RunError(str(error)) from None

"""Users."""

from datetime import UTC, datetime, timedelta
from http import HTTPStatus
from typing import Any

from fastapi import APIRouter
from pydantic import SecretStr

from bench.catalogue import UserRow
from bench.people import check_password, compute_rights, hash_password
from bench.service.audit import note_old
from bench.service.context import Context, ServiceContext
from bench.service.problems import ProblemError, make_conflict, make_not_found
from bench.service.requests import Sender, check_password_again, require_right
from bench.service.routes.people.views import UserChange, UserList, UserRequest, UserView, sort_rights

router = APIRouter(prefix="/users", tags=["people"])
_OWN_CHANGES = {"password", "current_password"}
"""Fields that persons change of themselves without the right to administer."""
_OF_PROVIDER = {"role", "full_name", *_OWN_CHANGES}
"""Fields that cannot be changed here for a user who signs in by the provider."""


@router.get("")
def list_users(context: Context) -> UserList:
    """List the users."""
    return UserList(items=tuple(_make_view(context, row) for row in context.catalogue.users.list_users()))


@router.post("", status_code=201)
def add_user(request: UserRequest, context: Context) -> UserView:
    """Add a user; without a password, the user cannot sign in until one is set."""
    row = UserRow(
        name=request.name,
        full_name=request.full_name,
        role=request.role,
        extra_rights=list(request.extra_rights),
        password_hash=_hash(request.password, request.name),
        disabled=False,
    )
    if not context.catalogue.users.add(row):
        detail = f"user {request.name} exists; change it with PATCH, or choose another name"
        raise make_conflict("user-exists", "The user exists", detail)
    return _make_view(context, _get_user(context, request.name))


@router.patch("/{name}")
def change_user(name: str, change: UserChange, context: Context, sender: Sender) -> UserView:
    """Change a user; everybody changes their own password, with the present one.

    Role, full name and password of a user of the provider are changed there.

    A changed password or a disabled user ends all sessions of this user but that of the sender.
    """
    given = change.model_fields_set
    is_own = sender.kind == "user" and sender.name == name
    if not is_own or not given <= _OWN_CHANGES:
        require_right(sender, "administer")
    row = _get_user(context, name)
    note_old(_make_view(context, row).model_dump(mode="json"))
    if row.external_id is not None and given & _OF_PROVIDER:
        detail = f"user {name} signs in by the provider; change {', '.join(sorted(given & _OF_PROVIDER))} there"
        raise make_conflict("external-user", "The provider administers this user", detail)
    if is_own and change.password is not None:
        check_password_again(context, row, change.current_password, "current_password")
    values: dict[str, Any] = change.model_dump(include=given - _OWN_CHANGES, exclude_none=True, mode="json")
    if change.password is not None:
        values["password_hash"] = _hash(change.password, name)
    context.catalogue.users.change(name, values)
    if "password_hash" in values or change.disabled:
        context.catalogue.sessions.end_all("user", name, but=sender.session or "")
    context.authenticator.forget()
    return _make_view(context, _get_user(context, name))


@router.delete("/{name}", status_code=204)
def remove_user(name: str, context: Context) -> None:
    """Remove a user with the sessions and tokens; what the user has done stays recorded."""
    note_old(_make_view(context, _get_user(context, name)).model_dump(mode="json"))
    context.catalogue.users.remove(name)
    context.catalogue.sessions.end_all("user", name)
    context.catalogue.tokens.revoke_all(f"user:{name}")
    context.authenticator.forget()


def _get_user(context: ServiceContext, name: str) -> UserRow:
    row = context.catalogue.users.find(name)
    if row is None:
        raise make_not_found("user", name)
    return row


def _hash(password: SecretStr | None, name: str) -> str | None:
    if password is None:
        return None
    try:
        return hash_password(check_password(password.get_secret_value(), name))
    except ValueError as error:
        detail = f"password: {error}"
        raise ProblemError(HTTPStatus.UNPROCESSABLE_ENTITY, "invalid-request", "Invalid request", detail) from None


def _make_view(context: ServiceContext, row: UserRow) -> UserView:
    wait = context.attempts.get_wait(f"user:{row.name}")
    return UserView(
        name=row.name,
        full_name=row.full_name,
        role=row.role,
        extra_rights=sort_rights(row.extra_rights),
        rights=sort_rights(compute_rights(row.role, row.extra_rights)),
        disabled=row.disabled,
        has_password=row.password_hash is not None,
        external=row.external_id is not None,
        created=row.created,
        last_seen=row.last_seen,
        locked_until=datetime.now(UTC) + timedelta(seconds=wait) if wait else None,
        revision=row.revision,
    )

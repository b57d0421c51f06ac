"""Tokens of programs."""

from datetime import UTC, datetime, timedelta
from typing import Literal

from fastapi import APIRouter

from bench.catalogue import TokenRow
from bench.people import ROLES, compute_rights, new_secret
from bench.service.audit import note_old
from bench.service.context import Context
from bench.service.problems import make_not_found
from bench.service.requests import Sender, require_right
from bench.service.routes.people.views import NewTokenView, TokenList, TokenRequest, TokenView, sort_rights

router = APIRouter(prefix="/tokens", tags=["people"])


@router.get("")
def list_tokens(context: Context, sender: Sender) -> TokenList:
    """List the tokens that the sender has created; an administrator sees all."""
    rows = context.catalogue.tokens.list_tokens()
    seen = [row for row in rows if "administer" in sender.rights or row.created_by == sender.actor]
    return TokenList(items=tuple(map(_make_view, seen)))


@router.post("", status_code=201)
def add_token(request: TokenRequest, context: Context, sender: Sender) -> NewTokenView:
    """Create a token for a program, with the role of the sender at most; the token is in this answer only."""
    if ROLES.index(request.role) > ROLES.index(sender.role):
        require_right(sender, "administer")
    token, sha256 = new_secret()
    lifetime = timedelta(days=request.expires_in_days)
    row = context.catalogue.tokens.add(sha256, request.label, request.role, sender.actor, lifetime)
    return NewTokenView(**_make_view(row).model_dump(), token=token)


@router.delete("/{token_id}", status_code=204)
def revoke_token(token_id: str, context: Context, sender: Sender) -> None:
    """Revoke a token at once, and end the sessions that it has begun."""
    row = context.catalogue.tokens.get(token_id)
    if row is None:
        raise make_not_found("token", token_id)
    if row.created_by != sender.actor:
        require_right(sender, "administer")
    note_old(_make_view(row).model_dump(mode="json"))
    context.catalogue.tokens.revoke(token_id)
    context.authenticator.forget()


def _make_view(row: TokenRow) -> TokenView:
    state: Literal["valid", "expired", "revoked"] = "valid" if row.is_valid(datetime.now(UTC)) else "expired"
    return TokenView(
        id=row.id,
        label=row.label,
        role=row.role,
        rights=sort_rights(compute_rights(row.role)),
        created=row.created,
        created_by=row.created_by,
        expires=row.expires,
        last_used=row.last_used,
        state="revoked" if row.revoked is not None else state,
    )

"""Sign-in of browsers: by password, by token, or by the code of another device."""

import asyncio
from datetime import UTC, datetime, timedelta
from http import HTTPStatus
from typing import Any

import segno
from fastapi import APIRouter, Request, Response

from bench.people import CODE_LIFETIME, is_password, new_secret
from bench.service import problems
from bench.service.access import Identity, compute_csrf, get_cookie_name, read_cookie
from bench.service.context import Context, ServiceContext
from bench.service.problems import ProblemError
from bench.service.requests import Sender, check_wait
from bench.service.routes.people.views import CodeView, Person, SessionView, SignInRequest, sort_rights

public_router = APIRouter(prefix="/session", tags=["people"])
router = APIRouter(prefix="/session", tags=["people"])
_HASHING = asyncio.Semaphore(2)
"""Limit of simultaneous hashes, each of which takes a processor and 64 MiB for a moment."""
_RESPONSES: dict[int | str, dict[str, Any]] = {
    **{status: problems.RESPONSES[status] for status in (400, 401, 413, 422)},
    429: {**problems.RESPONSES[401], "description": "Too many failed attempts; see Retry-After"},
}


@public_router.post("", status_code=201, responses=_RESPONSES)
async def sign_in(request: SignInRequest, http: Request, response: Response, context: Context) -> SessionView:
    """Sign in; the session is in a cookie that scripts cannot read."""
    identity = await _check_credentials(context, request, http)
    secret = await begin_session(context, identity, http, response)
    signed_in = await asyncio.to_thread(context.authenticator.identify, "session", secret)
    return _make_view(signed_in or identity, secret)


async def begin_session(context: ServiceContext, identity: Identity, http: Request, response: Response) -> str:
    """Begin a session, set its cookie, and return the secret in it."""
    secret, sha256 = new_secret()
    row = await asyncio.to_thread(context.catalogue.sessions.add, sha256, identity.kind, identity.subject)
    response.set_cookie(
        get_cookie_name(http.scope),
        secret,
        expires=row.expires,
        path="/api/",
        httponly=True,
        samesite="strict",
        secure=http.url.scheme == "https",
    )
    return secret


@router.get("")
def get_session(sender: Sender, http: Request) -> SessionView:
    """Return who is signed in."""
    return _make_view(sender, None if sender.session is None else read_cookie(http.scope))


@router.delete("", status_code=204)
def sign_out(sender: Sender, http: Request, response: Response, context: Context) -> None:
    """End the session of the cookie; without one, nothing is done."""
    if sender.session is not None:
        context.catalogue.sessions.end(sender.session)
        context.authenticator.forget()
    response.delete_cookie(get_cookie_name(http.scope), path="/api/", httponly=True, samesite="strict")


@router.post("/codes", status_code=201)
def make_code(sender: Sender, http: Request, context: Context) -> CodeView:
    """Make a code by which another device signs in as the same person, once, within two minutes."""
    made = context.codes.create((sender.kind, sender.subject))
    url = f"{http.base_url}#code={made.code}"
    return CodeView(
        code=f"{made.code[:4]}-{made.code[4:]}",
        expires=datetime.now(UTC) + timedelta(seconds=CODE_LIFETIME),
        expires_in_s=CODE_LIFETIME,
        url=url,
        svg=segno.make(url, error="m").svg_inline(scale=4, border=4, light="#fff", title="QR code for signing in"),
    )


async def _check_credentials(context: ServiceContext, request: SignInRequest, http: Request) -> Identity:
    """Return who signs in.

    Raises:
        ProblemError: the credentials are wrong, or there were too many failures before.
    """
    if request.token is not None:
        token = request.token.get_secret_value()
        return _require(
            await asyncio.to_thread(context.authenticator.identify, "token", token), "the token is wrong"
        )
    key = f"user:{request.name}" if request.code is None else f"code:{http.client.host if http.client else ''}"
    check_wait(context.attempts.get_wait(key))
    if request.code is not None:
        found = await asyncio.to_thread(_redeem, context, request.code.get_secret_value())
        reason = "the code is wrong, was used, or has ended; make a new one on the other device"
    else:
        async with _HASHING:
            found = await asyncio.to_thread(_check_password, context, request)
        reason = "name or password is wrong, or the user is disabled"
    if found is None:
        context.attempts.record_failure(key)
    else:
        context.attempts.record_success(key)
    return _require(found, reason)


def _redeem(context: ServiceContext, code: str) -> Identity | None:
    owner = context.codes.redeem(code)
    return None if owner is None else context.authenticator.find_subject(*owner)


def _check_password(context: ServiceContext, request: SignInRequest) -> Identity | None:
    row = context.catalogue.users.find(request.name or "")
    password = request.password.get_secret_value() if request.password else ""
    if not is_password(password, row.password_hash if row else None) or row is None or row.disabled:
        return None
    context.catalogue.users.record_sign_in(row.name)
    return context.authenticator.find_subject("user", row.name)


def _require(identity: Identity | None, reason: str) -> Identity:
    if identity is None:
        raise ProblemError(HTTPStatus.UNAUTHORIZED, "sign-in-failed", "Sign-in failed", reason)
    return identity


def _make_view(identity: Identity, secret: str | None) -> SessionView:
    expires = identity.expires
    return SessionView(
        person=Person(
            name=identity.name,
            full_name=identity.full_name,
            role=identity.role,
            rights=sort_rights(identity.rights),
        ),
        kind="user" if identity.kind == "user" else "token",
        csrf=None if secret is None else compute_csrf(secret),
        expires=expires,
        expired_in_s=None if expires is None else (expires - datetime.now(UTC)).total_seconds(),
    )

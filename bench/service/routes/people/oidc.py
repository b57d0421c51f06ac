"""Sign-in by a provider (OpenID Connect), and the ways to sign in."""

import asyncio
import logging
from http import HTTPStatus
from typing import Annotated, Any
from urllib.parse import urlencode

from anyio import CapacityLimiter, to_thread
from fastapi import APIRouter, Query, Request
from fastapi.responses import RedirectResponse

from bench.oidc import PENDING_LIFETIME, Fault, PendingSignIn, Provider, SignInError
from bench.service import problems
from bench.service.access import PeopleStores, find_or_add_user, get_cookie_name
from bench.service.context import Context, ServiceContext
from bench.service.problems import make_not_found, shorten
from bench.service.routes.people.session import begin_session
from bench.service.routes.people.views import ProviderView, SignInWays

public_router = APIRouter(prefix="/session", tags=["people"])
_LOG = logging.getLogger(__name__)
_WAITING = CapacityLimiter(4)
"""Threads that may wait for the provider, so that a silent one holds up nothing else."""
_COOKIE_PATH = "/api/v1/session/oidc"
_RESPONSES: dict[int | str, dict[str, Any]] = {
    303: {"description": "Continue at the address in Location"},
    404: problems.RESPONSES[404],
    422: problems.RESPONSES[422],
}


@public_router.get("/ways")
def list_ways(context: Context) -> SignInWays:
    """Return the ways to sign in."""
    provider = context.provider
    return SignInWays(password=True, oidc=None if provider is None else ProviderView(name=provider.config.name))


@public_router.get("/oidc", status_code=303, response_class=RedirectResponse, responses=_RESPONSES)
async def begin_sign_in(
    http: Request,
    context: Context,
    view: Annotated[str, Query(description="address within the page that is shown afterwards")] = "/",
) -> RedirectResponse:
    """Send the browser to the provider; after a failure, back to the page."""
    provider = _get_provider(context)
    page, shown = _find_page(provider, http), _check_view(view)
    try:
        back = f"{page}api/v1/session/oidc/callback"
        address, secret = await to_thread.run_sync(provider.begin, back, shown, limiter=_WAITING)
    except SignInError as error:
        return _return_to_page(page, shown, error)
    response = RedirectResponse(address, HTTPStatus.SEE_OTHER)
    # Lax, because the browser returns from another site.
    response.set_cookie(
        _name_cookie(http),
        secret,
        max_age=PENDING_LIFETIME,
        path=_COOKIE_PATH,
        httponly=True,
        samesite="lax",
        secure=http.url.scheme == "https",
    )
    return response


@public_router.get("/oidc/callback", status_code=303, response_class=RedirectResponse, responses=_RESPONSES)
async def end_sign_in(
    http: Request, context: Context, state: str = "", code: str = "", error: str = ""
) -> RedirectResponse:
    """Receive the browser from the provider, and begin its session; after a failure, return to the page."""
    provider = _get_provider(context)
    page, view = _find_page(provider, http), "/"
    try:
        pending = provider.take(state, http.cookies.get(_name_cookie(http), ""))
        view = pending.view
        if error or not code:
            raise SignInError(Fault.REFUSED, f"the provider answered {shorten(error) or 'without a code'}")
        name = await to_thread.run_sync(_identify, context, provider, pending, code, limiter=_WAITING)
        response = RedirectResponse(f"{page}#{view}", HTTPStatus.SEE_OTHER)
        await _begin_session(context, name, http, response)
    except SignInError as failure:
        response = _return_to_page(page, view, failure)
    response.delete_cookie(_name_cookie(http), path=_COOKIE_PATH, httponly=True, samesite="lax")
    return response


def _identify(context: ServiceContext, provider: Provider, pending: PendingSignIn, code: str) -> str:
    """Return the name of the user who has signed in at the provider."""
    catalogue = context.catalogue
    stores = PeopleStores(catalogue.users, catalogue.tokens, catalogue.sessions)
    person = provider.identify(pending, code)
    try:
        name = find_or_add_user(person, stores).name
    finally:
        context.authenticator.forget()  # role and sessions may have changed
    catalogue.users.record_sign_in(name)
    return name


async def _begin_session(context: ServiceContext, name: str, http: Request, response: RedirectResponse) -> None:
    identity = await asyncio.to_thread(context.authenticator.identify_user, name)
    if identity is None:
        raise SignInError(Fault.DISABLED, f"{name}: was disabled or removed at this moment")
    await begin_session(context, identity, http, response)


def _get_provider(context: ServiceContext) -> Provider:
    if context.provider is None:
        raise make_not_found("way to sign in", "oidc")
    return context.provider


def _find_page(provider: Provider, http: Request) -> str:
    """Return the address of the page in the browser, with a slash at its end."""
    return f"{(provider.config.page_address or str(http.base_url)).rstrip('/')}/"


def _check_view(view: str) -> str:
    """Return an address within the page; anything else leads to the first view."""
    return view if view.startswith("/") and len(view) <= 1000 else "/"


def _name_cookie(http: Request) -> str:
    return f"{get_cookie_name(http.scope)}_oidc"


def _return_to_page(page: str, view: str, error: SignInError) -> RedirectResponse:
    """Return to the sign-in in the page, which has a sentence for each kind of failure."""
    _LOG.warning("sign_in_failed", extra={"fault": error.fault.value, "reason": shorten(str(error), 500)})
    query = urlencode({"problem": error.fault.value, "view": view}, safe="/")
    return RedirectResponse(f"{page}#{query}", HTTPStatus.SEE_OTHER)

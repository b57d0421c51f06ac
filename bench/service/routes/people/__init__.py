"""Routes of people: sessions of browsers, users, tokens of programs."""

from bench.service.routes.people import oidc, session, tokens, users

PUBLIC_ROUTERS = (session.public_router, oidc.public_router)
"""Routers that need no sign-in."""
ROUTERS = (session.router, users.router, tokens.router)
"""Routers that need it."""

__all__ = ["PUBLIC_ROUTERS", "ROUTERS"]

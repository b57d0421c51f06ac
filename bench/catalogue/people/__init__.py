"""People in the catalogue: users, tokens of programs, and sessions of browsers."""

from bench.catalogue.people.sessions import SESSION_LIFETIME, SessionRow, SessionStore
from bench.catalogue.people.tokens import TokenRow, TokenStore
from bench.catalogue.people.users import UserRow, UserStore, check_user_name

__all__ = [
    "SESSION_LIFETIME",
    "SessionRow",
    "SessionStore",
    "TokenRow",
    "TokenStore",
    "UserRow",
    "UserStore",
    "check_user_name",
]

"""Requests and answers about people."""

from collections.abc import Collection
from datetime import datetime
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, SecretStr, model_validator

from bench.catalogue import check_user_name
from bench.people import RIGHTS, Right, Role
from bench.service.views import View

MAX_TOKEN_DAYS = 366
MAX_NAME = 200
"""Largest number of characters of a full name or of a label."""


class SignInRequest(View):
    """Name and password, a token, or the code that another device shows."""

    name: str | None = Field(default=None, max_length=MAX_NAME, description="name of the user")
    password: SecretStr | None = Field(default=None, max_length=1000)
    token: SecretStr | None = Field(
        default=None, max_length=1000, description="token of the bench or of a program"
    )
    code: SecretStr | None = Field(default=None, max_length=40, description="eight digits of another device")

    @model_validator(mode="after")
    def _check_one_way(self) -> Self:
        ways = [self.name is not None and self.password is not None, self.token is not None, self.code is not None]
        if sum(ways) != 1 or (self.name is None) != (self.password is None):
            raise ValueError("give name and password, or token, or code")
        return self


class Person(View):
    """Person or program that is signed in."""

    name: str
    full_name: str
    role: Role
    rights: tuple[Right, ...]


class SessionView(View):
    """A sign-in."""

    person: Person
    kind: Literal["user", "token"] = Field(
        description="token: signed in by the token of the bench or of a program"
    )
    csrf: str | None = Field(
        description="value for the header X-CSRF-Token of every request that changes something; null with a token"
    )
    expires: datetime | None = Field(description="UTC at which the sign-in ends; null if it does not")
    expired_in_s: float | None = Field(description="time until then [s]")


class ProviderView(View):
    """Provider by which persons sign in."""

    name: str = Field(description="name for the button")


class SignInWays(View):
    """Ways to sign in."""

    password: bool = Field(description="whether local users sign in by a password; true")
    oidc: ProviderView | None = Field(description="provider behind GET /session/oidc; null without one")


class CodeView(View):
    """Code by which another device signs in as the same person, once."""

    code: str = Field(description="digits, in two groups")
    expires: datetime = Field(description="UTC at which it ends")
    expires_in_s: float = Field(description="time until then [s]")
    url: str = Field(description="address of the page with the code")
    svg: str = Field(description="QR code of the address, as SVG")


class UserView(View):
    """One user."""

    name: str
    full_name: str
    role: Role
    extra_rights: tuple[Right, ...] = Field(description="rights beyond those of the role")
    rights: tuple[Right, ...]
    disabled: bool
    has_password: bool
    external: bool = Field(description="signs in by the provider only, which gives the role and the full name")
    created: datetime = Field(description="UTC")
    last_seen: datetime | None = Field(description="UTC of the latest sign-in")
    locked_until: datetime | None = Field(description="UTC until which failed sign-ins lock the user out")
    revision: int


class UserList(View):
    """All users."""

    items: tuple[UserView, ...]


class UserRequest(View):
    """A new user."""

    name: Annotated[str, AfterValidator(check_user_name)] = Field(description="small letters, digits and . _ -")
    full_name: str = Field(default="", max_length=MAX_NAME)
    role: Role
    extra_rights: tuple[Right, ...] = ()
    password: SecretStr | None = Field(default=None, max_length=1000, description="12 characters at least")


class UserChange(View):
    """Change of a user; fields that are left out stay as they are."""

    full_name: str | None = Field(default=None, max_length=MAX_NAME)
    role: Role | None = None
    extra_rights: tuple[Right, ...] | None = None
    disabled: bool | None = None
    password: SecretStr | None = Field(default=None, max_length=1000, description="new password")
    current_password: SecretStr | None = Field(
        default=None, max_length=1000, description="present password, for a change of one's own"
    )


class TokenView(View):
    """One token of a program, without the token itself."""

    id: str
    label: str
    role: Role
    rights: tuple[Right, ...]
    created: datetime = Field(description="UTC")
    created_by: str
    expires: datetime = Field(description="UTC")
    last_used: datetime | None = Field(description="UTC, in steps of five minutes")
    state: Literal["valid", "expired", "revoked"]


class NewTokenView(TokenView):
    """A new token; it is shown here only."""

    token: str


class TokenList(View):
    """Tokens, newest first."""

    items: tuple[TokenView, ...]


class TokenRequest(View):
    """A new token."""

    label: str = Field(min_length=1, max_length=MAX_NAME, description="program and purpose")
    role: Role = Field(description="at most the role of who creates it")
    expires_in_days: int = Field(ge=1, le=MAX_TOKEN_DAYS, description="time until it ends [days]")


def sort_rights(rights: Collection[Right]) -> tuple[Right, ...]:
    """Return rights in their usual order."""
    return tuple(right for right in RIGHTS if right in rights)

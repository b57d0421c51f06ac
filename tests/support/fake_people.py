"""People, sessions and tokens of the fake service for the web page."""

import secrets
import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from typing import Any

from fastapi import APIRouter, Request, Response
from fastapi.responses import JSONResponse

TOKEN = "a-token"
PASSWORD = "correct horse battery"
COOKIE = "mrbench_session"
CODE_S = 120
LOCKED_S = 3
FAILURES = 3
ROLES = ("viewer", "technician", "engineer", "administrator")
ADDED = {
    "viewer": ("view", "stop"),
    "technician": ("operate", "analyse", "sign_reports"),
    "engineer": ("reset_trip", "manage_methods", "approve_methods", "change_limits", "manage_runs"),
    "administrator": ("administer",),
}
EXTERNAL = {"name": "wpauli", "full_name": "Wolfgang Pauli", "role": "technician", "password": ""}
"""Person of an identity provider; the fake one does not sign in."""
SVG = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 3 3"><path d="M0 0h1v1H0zM2 0h1v1H2zM1 1h1v2H1z"/></svg>'
)
Problem = Callable[..., JSONResponse]


def rights_of(role: str, extra: list[str]) -> list[str]:
    """Return the rights of a role with further ones."""
    return [right for one in ROLES[: ROLES.index(role) + 1] for right in ADDED[one]] + extra


def utc(seconds: float = 0) -> str:
    """Return the time after some seconds."""
    return (datetime.now(UTC) + timedelta(seconds=seconds)).isoformat().replace("+00:00", "Z")


class FakePeople:
    """Users, sessions and tokens; the bench's token signs in as an administrator."""

    def __init__(self) -> None:
        self.sessions: dict[str, dict[str, Any]] = {}
        self.codes: dict[str, dict[str, Any]] = {}
        self.made_codes = 0
        self.passwords: dict[str, str] = {}
        self.failures: dict[str, int] = {}
        self.locked: dict[str, float] = {}
        self.users: dict[str, dict[str, Any]] = {}
        self.tokens: dict[str, dict[str, Any]] = {}
        for name, full_name, role in (
            ("mcurie", "Marie Curie", "administrator"),
            ("lmeitner", "Lise Meitner", "technician"),
            ("vguest", "Visiting Guest", "viewer"),
        ):
            self.add_user({"name": name, "full_name": full_name, "role": role, "password": PASSWORD})
        self.add_user(EXTERNAL)
        self.users["wpauli"] |= {"external": True, "has_password": False}
        self.add_token({"label": "nightly export", "role": "viewer", "expires_in_days": 90}, "user:mcurie")
        self.tokens["t-1"]["last_used"] = utc(-3600)

    def add_user(self, wanted: dict[str, Any]) -> dict[str, Any]:
        """Add a user."""
        name, extra = wanted["name"], wanted.get("extra_rights", [])
        self.passwords[name] = wanted["password"]
        self.users[name] = {
            "name": name, "full_name": wanted["full_name"], "role": wanted["role"], "extra_rights": extra,
            "rights": rights_of(wanted["role"], extra), "disabled": False, "has_password": True, "created": utc(),
            "last_seen": None, "locked_until": None, "revision": 1, "external": False,
        }  # fmt: skip
        return self.users[name]

    def add_token(self, wanted: dict[str, Any], creator: str) -> dict[str, Any]:
        """Add a token of a program."""
        made = {
            "id": f"t-{len(self.tokens) + 1}", "label": wanted["label"], "role": wanted["role"],
            "rights": rights_of(wanted["role"], []), "created": utc(), "created_by": creator,
            "expires": utc(86400 * wanted["expires_in_days"]), "last_used": None, "state": "valid",
        }  # fmt: skip
        self.tokens[made["id"]] = made
        return made

    def identify(self, request: Request) -> dict[str, Any] | None:
        """Return the session of a request; None if it has none."""
        if request.headers.get("authorization") == f"Bearer {TOKEN}":
            return bench_session()
        return self.sessions.get(request.cookies.get(COOKIE, ""))

    def check(self, wanted: dict[str, Any]) -> dict[str, Any] | None:
        """Return a session for credentials; None if they are wrong."""
        if "token" in wanted:
            return bench_session() if wanted["token"] == TOKEN else None
        if "code" in wanted:
            return self.codes.pop(wanted["code"], None)
        user = self.users.get(wanted["name"])
        if user is None or user["disabled"] or self.passwords[user["name"]] != wanted["password"]:
            return None
        user["last_seen"] = utc()
        return make_session({key: user[key] for key in ("name", "full_name", "role", "rights")}, "user")

    def fail(self, name: str) -> None:
        """Count a failure; some in sequence lock the name for a moment."""
        self.failures[name] = self.failures.get(name, 0) + 1
        if self.failures[name] % FAILURES == 0:
            self.locked[name] = time.monotonic() + LOCKED_S


def make_session(person: dict[str, Any], kind: str) -> dict[str, Any]:
    """Return a session as the service describes it."""
    csrf = secrets.token_hex(8)
    return {"person": person, "kind": kind, "csrf": csrf, "expires": utc(43200), "expired_in_s": 43200.0}


def bench_session() -> dict[str, Any]:
    """Return the session of the holder of the bench's token."""
    person = {"name": "bench", "full_name": "token of the bench", "role": "administrator"}
    return make_session(person | {"rights": rights_of("administrator", [])}, "token")


def people_routes(people: FakePeople, problem: Problem) -> APIRouter:
    """Create the routes of sessions, users and tokens."""
    router = APIRouter()
    add_session_routes(router, people, problem)
    add_user_routes(router, people, problem)
    add_token_routes(router, people)
    return router


def add_session_routes(router: APIRouter, people: FakePeople, problem: Problem) -> None:
    """Add sign-in and sign-out; ``expire`` exists for tests and ends all sessions."""

    @router.post("/session", status_code=201)
    async def sign_in(wanted: dict[str, Any], response: Response) -> Any:
        name = wanted.get("name", "")
        wait = people.locked.get(name, 0) - time.monotonic()
        if wait > 0:
            return problem(
                429, "Too many attempts", "too many sign-ins failed", "too-many-attempts", round(wait + 0.5)
            )
        session = people.check(wanted)
        if session is None:
            people.fail(name)
            return problem(401, "Sign-in failed", "the credentials are wrong", "sign-in-failed")
        secret = secrets.token_hex(16)
        people.sessions[secret] = session
        response.set_cookie(COOKIE, secret, path="/api/", httponly=True, samesite="strict")
        return session

    @router.get("/session")
    async def session(request: Request) -> Any:
        return people.identify(request)

    @router.delete("/session", status_code=204)
    async def sign_out(request: Request) -> None:
        people.sessions.pop(request.cookies.get(COOKIE, ""), None)

    @router.get("/session/ways")
    async def list_ways() -> dict[str, Any]:
        return {"password": True, "oidc": None}

    @router.post("/session/codes", status_code=201)
    async def code(request: Request) -> Any:
        people.made_codes += 1
        code = f"{4820 + people.made_codes:04}7730"
        own = people.identify(request)
        assert own is not None
        people.codes[code] = make_session(own["person"], own["kind"])
        url = f"{request.base_url}#code={code}"
        shown = f"{code[:4]}-{code[4:]}"
        return {"code": shown, "expires": utc(CODE_S), "expires_in_s": CODE_S, "url": url, "svg": SVG}

    @router.post("/expire", status_code=204)
    async def expire() -> None:
        people.sessions.clear()


def add_user_routes(router: APIRouter, people: FakePeople, problem: Problem) -> None:
    """Add the routes of users."""

    @router.get("/users")
    async def users(request: Request) -> Any:
        own = people.identify(request)
        if own is None or "administer" not in own["person"]["rights"]:
            detail = "you lack the right administer, which the role administrator has"
            return problem(403, "Not permitted", detail, "right-missing")
        return {"items": list(people.users.values())}

    @router.post("/users", status_code=201)
    async def add(wanted: dict[str, Any]) -> Any:
        if wanted["name"] in people.users:
            return problem(409, "The user exists", f"user {wanted['name']} exists; choose another name")
        return people.add_user(wanted)

    @router.patch("/users/{name}")
    async def change(name: str, wanted: dict[str, Any], request: Request) -> Any:
        user, own = people.users[name], people.identify(request)
        if user["external"] and {"role", "full_name", "password"} & wanted.keys():
            return problem(409, "The provider administers this user", f"user {name} signs in by the provider")
        is_own = own is not None and own["person"]["name"] == name and "password" in wanted
        if is_own and wanted.get("current_password") != people.passwords[name]:
            return problem(403, "The present password is wrong", "give the present password", "wrong-password")
        if user["role"] == "administrator" and (
            wanted.get("disabled") or wanted.get("role", user["role"]) != user["role"]
        ):
            return problem(409, "Not possible", f"{name} is the last administrator who may sign in")
        people.passwords[name] = wanted.get("password", people.passwords[name])
        known = {key: value for key, value in wanted.items() if key in user}
        user.update(known, revision=user["revision"] + 1)
        user["rights"] = rights_of(user["role"], user["extra_rights"])
        return user

    @router.delete("/users/{name}", status_code=204)
    async def remove(name: str) -> None:
        del people.users[name]


def add_token_routes(router: APIRouter, people: FakePeople) -> None:
    """Add the routes of tokens."""

    @router.get("/tokens")
    async def tokens() -> Any:
        return {"items": list(people.tokens.values())[::-1]}

    @router.post("/tokens", status_code=201)
    async def add(wanted: dict[str, Any], request: Request) -> Any:
        own = people.identify(request)
        assert own is not None
        return people.add_token(wanted, f"user:{own['person']['name']}") | {
            "token": "mrb_" + "0123456789abcdef" * 2
        }

    @router.delete("/tokens/{token}", status_code=204)
    async def revoke(token: str) -> None:
        people.tokens[token]["state"] = "revoked"

"""Identity of the sender of a request, by token or by session."""

import time
from collections import OrderedDict
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from threading import Lock
from typing import Literal, TypeAlias

from bench.catalogue import SessionRow, SessionStore, TokenStore, UserRow, UserStore
from bench.people import compute_rights, compute_sha256
from bench.service.access.bench_token import Access
from bench.service.access.identity import Identity, make_bench_identity

CredentialKind: TypeAlias = Literal["token", "session"]
"""A token, or the secret in the cookie of a session."""
_KEPT_TIME = 2.0
"""Time for which an identity is not looked up again [s]; a change by another process counts after it."""
_MAX_KEPT = 1000


@dataclass(frozen=True)
class PeopleStores:
    """Stores of users, tokens and sessions."""

    users: UserStore
    tokens: TokenStore
    sessions: SessionStore


class Authenticator:
    """Looks up who has a token or a session; safe from any thread."""

    def __init__(self, access: Access, stores: PeopleStores) -> None:
        """Use the bench's own token, and the stores of the catalogue."""
        self._access, self._stores = access, stores
        self._kept: OrderedDict[tuple[CredentialKind, str], tuple[float, Identity]] = OrderedDict()
        self._lock = Lock()

    def recall(self, kind: CredentialKind, secret: str) -> Identity | None:
        """Return a known identity without access to the database; None if it must be looked up."""
        sha256 = compute_sha256(secret)
        if kind == "token" and self._access.is_hash(sha256):
            return make_bench_identity(sha256)
        with self._lock:
            found, identity = self._kept.get((kind, sha256), (0.0, None))
        is_fresh = identity is not None and time.monotonic() - found < _KEPT_TIME
        return identity if is_fresh and identity and not _has_expired(identity) else None

    def identify(self, kind: CredentialKind, secret: str) -> Identity | None:
        """Return who has a token or the cookie of a session; None if it is wrong or has ended."""
        known = self.recall(kind, secret)
        if known is not None:
            return known
        sha256 = compute_sha256(secret)
        identity = self._find_token(sha256) if kind == "token" else self._find_session(sha256)
        if identity is not None:  # wrong ones are not kept, so that a guess cannot push out others
            self._keep((kind, sha256), identity)
        return identity

    def recall_for_stop(self, kind: CredentialKind, secret: str) -> Identity | None:
        """Return the identity that was known before the catalogue was away, with the right to stop only."""
        with self._lock:
            _, identity = self._kept.get((kind, compute_sha256(secret)), (0.0, None))
        if identity is None or _has_expired(identity):
            return None
        return replace(identity, rights=identity.rights & {"stop"})

    def identify_user(self, name: str) -> Identity | None:
        """Return the identity of a user; None if there is none, or if it is disabled."""
        row = self._stores.users.find(name)
        return None if row is None or row.disabled else make_user_identity(row)

    def find_subject(self, kind: str, subject: str) -> Identity | None:
        """Return the identity of a user by name, or of a token by its hash; None if it may not sign in."""
        if kind == "user":
            return self.identify_user(subject)
        if kind == "bench":
            return make_bench_identity(subject) if self._access.is_hash(subject) else None
        return self._find_token(subject)

    def forget(self) -> None:
        """Look everybody up again, after a change."""
        with self._lock:
            self._kept.clear()

    def _keep(self, key: tuple[CredentialKind, str], identity: Identity) -> None:
        with self._lock:
            self._kept[key] = time.monotonic(), identity
            self._kept.move_to_end(key)
            if len(self._kept) > _MAX_KEPT:
                self._kept.popitem(last=False)

    def _find_token(self, sha256: str) -> Identity | None:
        row = self._stores.tokens.find(sha256)
        if row is None or not row.is_valid(datetime.now(UTC)):
            return None
        rights = compute_rights(row.role)
        kind, _, creator = row.created_by.partition(":")
        if kind == "user":  # a token can do no more than its creator at present
            user = self.identify_user(creator)
            rights &= user.rights if user else frozenset()
            if not rights:
                return None
        self._stores.tokens.record_use(row)
        return Identity("token", row.label, row.label, row.role, rights, sha256, expires=row.expires)

    def _find_session(self, sha256: str) -> Identity | None:
        row = self._stores.sessions.find(sha256)
        if row is None or row.expires <= datetime.now(UTC):
            return None
        identity = self.find_subject(row.kind, row.subject)
        return None if identity is None else add_session(identity, row)


def make_user_identity(row: UserRow) -> Identity:
    """Return the identity of a user."""
    rights = compute_rights(row.role, row.extra_rights)
    return Identity("user", row.name, row.full_name or row.name, row.role, rights, row.name)


def add_session(identity: Identity, row: SessionRow) -> Identity:
    """Return an identity with its session, which ends with the token if that is earlier."""
    expires = min(row.expires, identity.expires) if identity.expires else row.expires
    return replace(identity, session=row.sha256, expires=expires)


def _has_expired(identity: Identity) -> bool:
    return identity.expires is not None and identity.expires <= datetime.now(UTC)

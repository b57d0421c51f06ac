"""Stores of people, certificates, methods and signatures, in each kind of database."""

from datetime import UTC, datetime, timedelta

import pytest
from sqlalchemy.exc import IntegrityError

from bench.calibration import parse_certificate
from bench.catalogue import Catalogue, MethodRow, SignatureRow, UserRow, open_database
from tests.support.certificates import make_certificate

NOW = datetime(2026, 3, 1, 10, tzinfo=UTC)
HASH = "a" * 64


@pytest.fixture
def catalogue(tmp_path, catalogue_url):
    catalogue = Catalogue(open_database(catalogue_url), tmp_path)
    yield catalogue
    catalogue.close()


def make_user(name="anna", **changes):
    return UserRow(**{"name": name, "role": "operator", "extra_rights": ["configure"], **changes})


def test_users_are_added_once_changed_and_removed(catalogue):
    users = catalogue.users
    assert users.add(make_user(external_id="issuer|7"))
    assert not users.add(make_user())
    with pytest.raises(IntegrityError):
        users.add(make_user("bert", external_id="issuer|7"))
    changed = users.change("anna", {"disabled": True})
    assert (changed.disabled, changed.revision, changed.extra_rights) == (True, 2, ["configure"])
    users.record_sign_in("anna")
    found = users.find_external("issuer|7")
    assert (found.name, found.last_seen.tzinfo) == ("anna", UTC)
    assert users.change("nobody", {"disabled": True}) is None
    assert [users.remove("anna"), users.remove("anna"), users.list_users()] == [True, False, []]


def test_sessions_end_one_by_one_and_all_but_one(catalogue):
    sessions = catalogue.sessions
    for name in ("a", "b", "c"):
        sessions.add(name, "user", "anna")
    sessions.end("a")
    assert sessions.find("a") is None
    sessions.end_all("user", "anna", but="b")
    assert (sessions.find("b").subject, sessions.find("c")) == ("anna", None)
    assert sessions.find("b").expires > datetime.now(UTC)


def test_a_token_is_found_used_and_revoked(catalogue):
    tokens = catalogue.tokens
    token = tokens.add(HASH, "logger", "operator", "anna", timedelta(days=1))
    tokens.record_use(token)
    assert tokens.find(HASH).last_used is not None
    tokens.revoke_all("anna")
    (stored,) = tokens.list_tokens()
    assert not stored.is_valid(datetime.now(UTC))


def test_the_first_approval_counts_until_it_is_withdrawn(catalogue):
    for name in ("anna", "bert"):
        catalogue.approvals.approve(HASH, name)
    assert {key: row.approved_by for key, row in catalogue.approvals.find([HASH, "b"]).items()} == {HASH: "anna"}
    catalogue.approvals.withdraw(HASH)
    assert catalogue.approvals.find([HASH]) == {}


def test_a_certificate_has_versions_and_is_withdrawn_once(catalogue):
    store, document = catalogue.certificates, parse_certificate(make_certificate(), "test")
    first = store.add(document, "anna")
    assert store.add(document, "anna") is None
    assert store.correct(first, document, "anna", "typing error")
    assert not store.correct(first, document, "anna", "the same version again")
    assert [one.row.version for one in store.list_newest()] == [2]
    assert list(store.list_current(datetime.now(UTC).date())) == ["force"]
    assert store.withdraw(first.row.id, "anna", "cell was dropped")
    assert not store.withdraw(first.row.id, "anna", "again")
    assert store.list_current(datetime.now(UTC).date()) == {}
    assert store.find(first.row.id, 1).withdrawal.reason == "cell was dropped"


def test_a_changed_method_is_a_new_version(catalogue):
    store = catalogue.methods

    def add(sha256):
        row, is_new = store.add(MethodRow(name="m", sha256=sha256, document={"x": 1}, created=NOW), 2)
        return row.version, is_new

    assert [add("a"), add("b"), add("a")] == [(2, True), (3, True), (2, False)]
    assert [row.version for row in store.list_newest()] == [3]
    assert (store.find_version("m", "a"), store.get("m").sha256) == (2, "b")


def test_signatures_are_listed_in_the_order_of_the_audit_trail(catalogue):
    for number in (2**40, 1):
        catalogue.signatures.add(
            SignatureRow(
                id=f"s-{number}", kind="run", subject="run-1", sha256=HASH, format="pdf", made=NOW, user="anna",
                full_name="Anna", meaning="author", signed=NOW, audit_seq=number,
            )
        )  # fmt: skip
    found = catalogue.signatures.list_signatures("run", "run-1")
    assert [(row.audit_seq, row.signed) for row in found] == [(1, NOW), (2**40, NOW)]
    assert catalogue.signatures.list_signatures("campaign", "run-1") == []

"""`mrbench user` and `mrbench token`, on the data folder of a service."""

import io

import pytest
import typer

from bench.catalogue import CATALOGUE_FILE, Catalogue, UserRow, make_sqlite_url, open_database
from bench.commands.people import token, user
from bench.commands.people.token import TokenAction
from bench.commands.people.user import RoleName, UserAction
from bench.errors import RunError
from bench.people import compute_sha256, is_password

PASSWORD = "correct horse battery"


@pytest.fixture
def act(tmp_path, monkeypatch, capsys):
    """Return a function that calls `mrbench user` with a password on its input, and returns what it prints."""

    def call(action, name="", typed=PASSWORD, **more):
        monkeypatch.setattr("sys.stdin", io.StringIO(typed + "\n"))
        given = {"role": None, "full_name": None, "disabled": None} | more
        user(UserAction(action), name, data=tmp_path, **given)
        return capsys.readouterr().out

    return call


@pytest.fixture
def catalogue(tmp_path):
    opened = Catalogue(open_database(make_sqlite_url(tmp_path / CATALOGUE_FILE)), tmp_path)
    yield opened
    opened.close()


def test_a_user_is_added_changed_and_removed(act, catalogue):
    act("add", "mcurie", role=RoleName.TECHNICIAN, full_name="M. Curie")
    assert act("list").split() == ["mcurie", "technician", "M.", "Curie"]
    assert is_password(PASSWORD, catalogue.users.find("mcurie").password_hash)
    act("change", "mcurie", role=RoleName.ENGINEER, disabled=True)
    assert act("list").split() == ["mcurie", "engineer", "M.", "Curie", "disabled"]
    act("change", "mcurie", disabled=False)
    assert not catalogue.users.find("mcurie").disabled
    act("remove", "mcurie")
    assert act("list") == ""


def test_a_new_password_ends_the_sessions(act, catalogue):
    act("add", "mcurie", role=RoleName.VIEWER)
    catalogue.sessions.add("hash", "user", "mcurie")
    act("password", "mcurie", typed="another long password")
    assert is_password("another long password", catalogue.users.find("mcurie").password_hash)
    assert catalogue.sessions.find("hash") is None


@pytest.mark.parametrize(
    ("call", "error", "reason"),
    [
        ({"action": "add", "name": "mcurie"}, typer.BadParameter, "--role"),
        ({"action": "add", "name": "M Curie", "role": RoleName.VIEWER}, RunError, "small letters"),
        ({"action": "add", "name": "mcurie", "role": RoleName.VIEWER, "typed": "short"}, RunError, "5 characters"),
        ({"action": "add", "name": "taken", "role": RoleName.VIEWER}, RunError, "user taken exists"),
        ({"action": "change", "name": "taken"}, typer.BadParameter, "what to change"),
        ({"action": "password", "name": "nobody"}, RunError, "there is no user nobody"),
        ({"action": "remove", "name": "nobody"}, RunError, "there is no user nobody"),
        ({"action": "remove"}, typer.BadParameter, "name of the user"),
    ],
)
def test_a_mistake_changes_nothing(act, call, error, reason):
    act("add", "taken", role=RoleName.ENGINEER)
    with pytest.raises(error, match=reason):
        act(**call)
    assert act("list").split() == ["taken", "engineer"]


def test_a_user_of_the_provider_is_only_disabled_and_removed_here(act, catalogue):
    row = UserRow(name="mcurie", role="viewer", extra_rights=[], external_id="https://login 4711", disabled=False)
    assert catalogue.users.add(row)
    for call in ({"action": "password"}, {"action": "change", "role": RoleName.ADMINISTRATOR}):
        with pytest.raises(RunError, match="user mcurie signs in by the provider"):
            act(name="mcurie", **call)
    assert act("list").split() == ["mcurie", "viewer", "signs", "in", "by", "the", "provider"]
    act("change", "mcurie", disabled=True)
    assert act("list").split() == ["mcurie", "viewer", "disabled"]
    act("remove", "mcurie")
    assert act("list") == ""


def test_a_token_is_printed_once_and_revoked(tmp_path, catalogue, capsys):
    token(TokenAction.ADD, "nightly", role=RoleName.TECHNICIAN, days=30, data=tmp_path)
    secret = capsys.readouterr().out.strip()
    row = catalogue.tokens.find(compute_sha256(secret))
    assert (row.label, row.role, row.created_by.partition(":")[0]) == ("nightly", "technician", "local")
    token(TokenAction.REVOKE, row.id, data=tmp_path)
    token(TokenAction.LIST, data=tmp_path)
    printed = capsys.readouterr().out
    assert printed.split()[:2] == [row.id, "revoked"]
    assert secret not in printed
    with pytest.raises(RunError, match="there is no token"):
        token(TokenAction.REVOKE, "nothing", data=tmp_path)

"""Address of a catalogue: which database a data folder has, and that no password is shown."""

import stat

import pytest

from bench.catalogue import Catalogue, open_catalogue, open_database
from bench.catalogue.database import (
    ADDRESS_FILE,
    CATALOGUE_FILE,
    describe_address,
    find_catalogue,
    has_catalogue,
    keep_address,
    locate_catalogue,
    parse_address,
)
from bench.catalogue.errors import CatalogueError
from bench.errors import SecretFileError

SECRET = "pass-word"
URL = f"postgresql://mrbench:{SECRET}@db.example.org:5433/lab?sslmode=require"


def test_a_folder_has_its_own_file_until_it_keeps_a_url(tmp_path):
    assert not has_catalogue(tmp_path)
    assert locate_catalogue(tmp_path) == f"sqlite:///{tmp_path / CATALOGUE_FILE}"
    with pytest.raises(CatalogueError, match="there is no catalogue"):
        find_catalogue(tmp_path)
    keep_address(tmp_path, URL)
    assert has_catalogue(tmp_path)
    assert find_catalogue(tmp_path) == locate_catalogue(tmp_path) == URL
    other = URL.replace("db.", "db2.")
    keep_address(tmp_path, other)
    assert find_catalogue(tmp_path) == other


def test_only_the_owner_reads_the_file_with_the_url(tmp_path):
    keep_address(tmp_path, URL)
    path = tmp_path / ADDRESS_FILE
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    path.chmod(0o640)
    with pytest.raises(SecretFileError, match="other users may read it"):
        find_catalogue(tmp_path)


def test_a_folder_with_a_catalogue_of_its_own_takes_no_url(tmp_path):
    with open_catalogue(tmp_path, is_created=True):
        pass
    with pytest.raises(CatalogueError, match="has a catalogue of its own") as refused:
        keep_address(tmp_path, URL)
    assert SECRET not in str(refused.value)
    assert not (tmp_path / ADDRESS_FILE).exists()


@pytest.mark.parametrize("kind", ["postgres", "postgresql", "postgresql+psycopg"])
def test_all_usual_forms_name_the_same_driver(kind):
    address = parse_address(URL.replace("postgresql", kind))
    assert (address.drivername, address.host, address.port, address.database, address.password) == (
        "postgresql+psycopg", "db.example.org", 5433, "lab", SECRET,
    )  # fmt: skip


@pytest.mark.parametrize(
    "url",
    [
        f"mysql://mrbench:{SECRET}@host/lab",
        f"postgresql://mrbench:{SECRET}@more@host/lab",
        f"postgresql://mrbench@host:{SECRET}/lab",
        f"{SECRET}",
        "",
    ],
)
def test_another_address_is_refused_and_not_quoted(url):
    with pytest.raises(CatalogueError, match="give postgresql://USER") as refused:
        parse_address(url)
    assert SECRET not in str(refused.value)
    assert refused.value.__cause__ is None


def test_only_a_server_is_kept(tmp_path):
    with pytest.raises(CatalogueError, match="give postgresql://USER"):
        keep_address(tmp_path, "sqlite:///elsewhere.db")


def test_a_password_is_nowhere_shown():
    for url in (URL, f"postgresql://mrbench@host/lab?password={SECRET}&sslpassword={SECRET}"):
        assert SECRET not in describe_address(parse_address(url))
    assert parse_address(f"postgresql://mrbench@host/lab?password={SECRET}").password == SECRET


def test_a_server_that_does_not_answer_is_named_without_the_password(tmp_path):
    with pytest.raises(CatalogueError, match=r"mrbench:\*\*\*@127\.0\.0\.1:9/lab cannot be opened") as refused:
        open_database(f"postgresql://mrbench:{SECRET}@127.0.0.1:9/lab")
    assert SECRET not in str(refused.value)


def test_a_command_on_the_folder_finds_the_server(tmp_path, postgres_server):
    url = postgres_server.make_catalogue()
    keep_address(tmp_path, url)
    with open_catalogue(tmp_path) as catalogue:
        assert catalogue.specimens.describe("MR-1", 0, {"description": "spare"})
    assert not (tmp_path / CATALOGUE_FILE).exists()
    again = Catalogue(open_database(url), tmp_path)
    assert again.specimens.find("MR-1").row.description == "spare"
    again.close()

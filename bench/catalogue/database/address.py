"""Address of a catalogue's database: an SQLite file of the data folder, or the URL that the folder keeps.

A URL may contain a password. So the file with it is private, and no message shows it.
"""

from pathlib import Path

from sqlalchemy import URL, make_url
from sqlalchemy.exc import ArgumentError

from bench.catalogue.errors import CatalogueError
from bench.private_file import check_private_file, create_private_file

CATALOGUE_FILE = "catalogue.db"
"""File of the catalogue in a data folder."""
ADDRESS_FILE = "catalogue.url"
"""File in a data folder with the URL of a catalogue that is elsewhere."""
SQLITE, POSTGRES = "sqlite", "postgresql"
_DRIVERS = {
    "sqlite": SQLITE,
    "postgres": "postgresql+psycopg",
    "postgresql": "postgresql+psycopg",
    "postgresql+psycopg": "postgresql+psycopg",
}
"""Driver of each kind of URL that is accepted."""
_SECRETS = ("sslpassword",)
"""Parameters of a URL that are never shown, besides the password."""
_EXPECTED = (
    "the address of the catalogue cannot be read; give postgresql://USER:PASSWORD@HOST:PORT/DATABASE, with %XX "
    "for special characters in the password"
)


def make_sqlite_url(path: Path) -> str:
    """Return the address of an SQLite file."""
    return f"sqlite:///{path}"


def find_catalogue(folder: Path) -> str:
    """Return the address of the catalogue of a data folder.

    Raises:
        CatalogueError: the folder has none.
        SecretFileError: other users may read its address.
    """
    if not has_catalogue(folder):
        path = folder / CATALOGUE_FILE
        raise CatalogueError(f"{path}: there is no catalogue; give the data folder of `mrbench serve`")
    return locate_catalogue(folder)


def has_catalogue(folder: Path) -> bool:
    """Return whether a data folder has a catalogue."""
    return (folder / ADDRESS_FILE).is_file() or (folder / CATALOGUE_FILE).is_file()


def locate_catalogue(folder: Path) -> str:
    """Return the URL that a data folder keeps, or else the address of its SQLite file, which may be missing.

    Raises:
        SecretFileError: other users may read the URL.
    """
    path = folder / ADDRESS_FILE
    if not path.is_file():
        return make_sqlite_url(folder / CATALOGUE_FILE)
    check_private_file(path, "the address of the catalogue, which `mrbench serve --catalogue` writes")
    return path.read_text().strip()


def keep_address(folder: Path, url: str) -> None:
    """Keep the URL of a catalogue in its data folder, so that every command on the folder finds it.

    Args:
        folder: data folder; it exists.
        url: address of the database; it replaces the one that was kept before.

    Raises:
        CatalogueError: the URL is not valid, or the folder has an SQLite catalogue.
        SecretFileError: the folder cannot be written to.
    """
    shown = describe_address(parse_server_address(url))
    own, path = folder / CATALOGUE_FILE, folder / ADDRESS_FILE
    # Beside an address, the file is what a transfer has left, and is no longer used.
    if own.is_file() and not path.is_file():
        raise CatalogueError(
            f"{own}: the folder has a catalogue of its own, and {shown} was given; call "
            f"`mrbench transfer --data {folder}` with this address first, or use another --data"
        )
    if path.is_file() and path.read_text().strip() == url:
        return
    # Replaced in one step: a folder without it would get a new SQLite catalogue at the next start.
    write_address(folder, url).replace(path)


def write_address(folder: Path, url: str) -> Path:
    """Write the URL of a catalogue to a file beside `catalogue.url`, and return that file, which is to replace it.

    Raises:
        SecretFileError: the folder cannot be written to.
    """
    written = folder / f".{ADDRESS_FILE}"
    written.unlink(missing_ok=True)
    create_private_file(written, lambda: f"{url}\n")
    return written


def parse_address(url: str) -> URL:
    """Return the parts of an address, with the driver that mrbench uses.

    Raises:
        CatalogueError: it is not an address of SQLite or PostgreSQL.
    """
    # The causes are not passed on: their texts may quote a password.
    try:
        address = make_url(url)
    except (ArgumentError, ValueError):
        raise CatalogueError(_EXPECTED) from None
    driver = _DRIVERS.get(address.drivername)
    if driver is None or "@" in (address.host or ""):
        raise CatalogueError(_EXPECTED)
    # The password has one place, so that it is nowhere shown.
    secret = address.query.get("password", address.password)
    address = address.difference_update_query(["password"])
    return address.set(drivername=driver, password=str(secret) if secret else None)


def parse_server_address(url: str) -> URL:
    """Return the parts of an address of PostgreSQL.

    Raises:
        CatalogueError: it is not such an address.
    """
    address = parse_address(url)
    if address.drivername == SQLITE:
        raise CatalogueError(_EXPECTED)
    return address


def describe_address(address: URL) -> str:
    """Return an address for a person, without its secrets and without the driver."""
    shown = address.difference_update_query(_SECRETS).set(drivername=address.get_backend_name())
    return shown.render_as_string(hide_password=True)

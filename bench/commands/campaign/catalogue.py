"""Campaigns of a data folder, opened by a command; the service may run meanwhile."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bench.campaigns import CampaignStore
from bench.catalogue import CATALOGUE_FILE, Catalogue, find_catalogue, make_sqlite_url, open_database
from bench.errors import RunError


@contextmanager
def open_store(data: Path, *, is_created: bool = False) -> Iterator[CampaignStore]:
    """Open the campaigns of a data folder.

    Args:
        data: data folder.
        is_created: create folder and catalogue if they are missing.

    Raises:
        BenchError: there is no catalogue, or it cannot be opened.
    """
    folder = data.resolve()
    if is_created:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RunError(f"{folder} cannot be created: {error.strerror}; use another --data") from None
    url = make_sqlite_url(folder / CATALOGUE_FILE) if is_created else find_catalogue(folder)
    catalogue = Catalogue(open_database(url), folder)
    try:
        yield CampaignStore(catalogue)
    finally:
        catalogue.close()

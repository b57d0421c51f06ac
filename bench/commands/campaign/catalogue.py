"""Campaigns of a data folder, opened by a command; the service may run meanwhile."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bench.campaigns import CampaignStore
from bench.catalogue import open_catalogue


@contextmanager
def open_store(data: Path, *, is_created: bool = False) -> Iterator[CampaignStore]:
    """Open the campaigns of a data folder.

    Args:
        data: data folder.
        is_created: create folder and catalogue if they are missing.

    Raises:
        BenchError: there is no catalogue, or it cannot be opened.
    """
    with open_catalogue(data, is_created=is_created) as catalogue:
        yield CampaignStore(catalogue)

"""Logs without a copy in a log store, as the catalogue finds them."""

from datetime import UTC, datetime

import pytest

from bench.catalogue.catalogue import Catalogue
from bench.catalogue.database import open_database
from bench.catalogue.scan import scan_logs
from bench.catalogue.trash import move_to_trash
from tests.support.service_logs import write_complete_log, write_truncated_log

STORE = "s3://bucket/100%_own"
"""Address with the characters that mean something in a pattern of a database."""


@pytest.fixture
def catalogue(tmp_path, catalogue_url):
    catalogue = Catalogue(open_database(catalogue_url), tmp_path)
    for name in "abcd":
        write_complete_log(tmp_path / f"{name}.mcap", name)
    write_truncated_log(tmp_path / "e.mcap", "e")
    scan_logs(catalogue, lambda path: False)
    yield catalogue
    catalogue.close()


def test_complete_logs_without_a_copy_in_this_store_wait(catalogue):
    waiting = catalogue.log_copies.list_waiting
    assert sorted(waiting(STORE)) == ["a", "b", "c", "d"]
    now = datetime.now(UTC)
    catalogue.update_run("a", copy_url=f"{STORE}/a.mcap", copied=now)
    catalogue.update_run("b", copy_url="s3://bucket/100 of own/b.mcap", copied=now)
    move_to_trash(catalogue, catalogue.get_run("c"))
    assert sorted(waiting(STORE)) == ["b", "d"]
    catalogue.update_run("b", removed=now)
    assert waiting(STORE) == ["d"]
    assert catalogue.get_run("a").copied == now

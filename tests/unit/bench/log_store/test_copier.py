"""Copies of logs to a store: verified, recorded, and repeated until they succeed."""

import fsspec
import pytest

from bench.catalogue import compute_sha256, move_to_trash
from bench.log_store import LogCopier, LogStoreError, LogStoreUnavailableError, check_object, copying
from bench.log_store.objects import hash_object, write_object
from bench.log_store.waits import LONGEST_WAIT, GrowingWait


class Clock:
    now = 0.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def copier(catalogue, store, clock):
    return LogCopier(catalogue, store, clock=clock)


def damage(url):
    """Write another content to an object, of the same size."""
    with fsspec.open(url, "rb") as file:
        content = bytearray(file.read())
    content[len(content) // 2] ^= 1
    with fsspec.open(url, "wb") as file:
        file.write(content)


def test_each_log_arrives_with_its_content_and_is_recorded(copier, catalogue, store):
    copier.copy_due()
    for name in ("a", "b"):
        row, path = catalogue.get_run(name), catalogue.folder / f"{name}.mcap"
        assert row.copy_url == f"{store}/{name}.{row.log_sha256[:16]}.mcap"
        assert hash_object(row.copy_url) == (compute_sha256(path), path.stat().st_size)
        assert row.copied is not None
    assert copier.describe_state() == "ok"
    assert copier.count() == (0, 2, 0, True)
    copier.copy_due()
    assert copier.count().copied == 2


def test_logs_wait_while_the_store_is_away_and_are_copied_when_it_is_back(copier, catalogue, clock, monkeypatch):
    tries = []

    def fail(path, url):
        tries.append(clock.now)
        raise LogStoreUnavailableError("the log store does not answer")

    with monkeypatch.context() as away:
        away.setattr(copying, "write_object", fail)
        for clock.now in range(40):
            copier.copy_due()
        assert tries == [0, 1, 3, 7, 15, 31], "one log is tried, with waits that grow"
        assert copier.describe_state() == (
            "2 logs wait for a copy; the log store does not answer; the next attempt follows within 26 s"
        )
        assert copier.count() == (2, 0, 6, False)
        assert catalogue.get_run("a").copy_url is None
    clock.now = 63
    copier.copy_due()
    assert copier.describe_state() == "ok"
    assert copier.count() == (0, 2, 6, True)


def test_a_copy_with_another_content_is_not_recorded_and_holds_up_no_other_log(
    copier, catalogue, monkeypatch, clock
):
    def write(path, url):
        write_object(path, url)
        if path.name == "a.mcap":
            damage(url)

    with monkeypatch.context() as damaging:
        damaging.setattr(copying, "write_object", write)
        copier.copy_due()
    assert catalogue.get_run("a").copy_url is None
    assert catalogue.get_run("b").copy_url is not None
    assert copier.describe_state().startswith("1 log waits for a copy; copies of 1 logs fail")
    copier.copy_due()
    assert copier.count() == (1, 1, 1, True), "it is not tried again before its wait"
    clock.now = 1.0
    copier.copy_due()
    assert catalogue.get_run("a").copy_url is not None
    assert copier.describe_state() == "ok"


def test_a_log_that_was_changed_is_not_copied(copier, catalogue, caplog):
    (catalogue.folder / "a.mcap").write_bytes(b"something else")
    copier.copy_due()
    assert [catalogue.get_run(name).copy_url is None for name in ("a", "b")] == [True, False]
    assert "a.mcap was changed" in "".join(str(record.__dict__.get("why")) for record in caplog.records)


def test_a_corrupted_object_is_refused(copier, catalogue):
    copier.copy_due()
    row = catalogue.get_run("a")
    check_object(row.copy_url, row)
    damage(row.copy_url)
    with pytest.raises(LogStoreError, match=f"has another content .* recorded {row.log_bytes} bytes"):
        check_object(row.copy_url, row)


def test_runs_in_the_trash_wait_for_nothing(copier, catalogue):
    move_to_trash(catalogue, catalogue.get_run("a"))
    copier.copy_due()
    assert catalogue.get_run("a").copy_url is None
    assert copier.count() == (0, 1, 0, True)


def test_a_new_store_gets_the_logs_of_the_former_one(copier, catalogue, store, tmp_path):
    copier.copy_due()
    (tmp_path / "other").mkdir()
    LogCopier(catalogue, f"file://{tmp_path}/other").copy_due()
    assert catalogue.get_run("a").copy_url.startswith(f"file://{tmp_path}/other/a.")
    assert len(list((tmp_path / "other").iterdir())) == 2


def test_waits_double_up_to_the_longest():
    wait, rests = GrowingWait(), []
    for _ in range(2000):
        wait.fail(10.0)
        rests.append(wait.find_rest(10.0))
    assert rests[:3] == [1.0, 2.0, 4.0]
    assert rests[-1] == LONGEST_WAIT
    assert wait.find_rest(1000.0) == 0

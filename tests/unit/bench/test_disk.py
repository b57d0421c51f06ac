"""Free space: estimate of a log's size, refusal, and warning."""

import os
import shutil
from types import SimpleNamespace

import pytest

from bench.disk import (
    LOW_SPACE,
    RESERVE,
    FreeSpace,
    SpaceMonitor,
    check_space,
    describe_low_space,
    estimate_log_size,
    find_free_space,
    find_usable_space,
)
from bench.errors import RunError


def test_a_log_grows_with_duration_and_rates():
    minute, hour = (estimate_log_size(seconds, [1000.0, 1000.0, 250.0]) for seconds in (60.0, 3600.0))
    assert minute == 70 * 2250 * 64
    assert hour == 3610 * 2250 * 64


def test_a_run_has_to_leave_the_reserve_free(tmp_path):
    check_space(FreeSpace(tmp_path, RESERVE + 5_000_000), 5_000_000)
    with pytest.raises(
        RunError, match=r"has 0\.105 GB free, but the log of this run needs up to 0\.005 GB and 0\.1"
    ):
        check_space(FreeSpace(tmp_path, RESERVE + 4_999_999), 5_000_000)


def test_little_space_is_a_warning_with_value_and_limit(tmp_path):
    assert describe_low_space(FreeSpace(tmp_path, LOW_SPACE)) == ""
    assert "has 0.400 GB free, less than 1.000 GB" in describe_low_space(FreeSpace(tmp_path, 400_000_000))


def test_a_folder_that_does_not_exist_yet_has_the_space_of_its_parent(tmp_path):
    assert find_free_space(tmp_path / "a" / "b").free > 0


def test_the_usable_space_leaves_the_reserve_and_is_not_known_without_an_answer(tmp_path, monkeypatch):
    usage = SimpleNamespace(free=RESERVE + 7)
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: usage)
    assert find_usable_space(tmp_path) == 7
    usage.free = 5
    assert find_usable_space(tmp_path) == 0

    def fail(folder):
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(shutil, "disk_usage", fail)
    assert find_usable_space(tmp_path) is None


def test_the_disk_is_asked_at_intervals(tmp_path, monkeypatch):
    asked, now = [], [0.0]

    def disk_usage(path):
        asked.append(path)
        return SimpleNamespace(free=0)

    monkeypatch.setattr(shutil, "disk_usage", disk_usage)
    monitor = SpaceMonitor(tmp_path, lambda: now[0])
    for now[0] in (0.0, 1.0, 4.9, 5.0):
        assert "has 0.000 GB free" in monitor.describe()
    assert len(asked) == 2


def test_a_disk_that_cannot_be_asked_is_a_warning(tmp_path, monkeypatch):
    def fail(path):
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(shutil, "disk_usage", fail)
    assert "the free space is not known (Input/output error)" in SpaceMonitor(tmp_path).describe()


def make_read_only(path):
    return SimpleNamespace(f_flag=os.ST_RDONLY, f_bavail=9, f_bfree=9, f_blocks=9, f_frsize=LOW_SPACE)


@pytest.mark.parametrize(
    ("name", "replacement", "reason"),
    [
        ("statvfs", make_read_only, "is on a read-only file system; mount it for writing"),
        ("access", lambda path, mode: False, "cannot be written by this user"),
    ],
)
def test_a_folder_that_cannot_be_written_refuses_a_run_and_is_a_warning(
    tmp_path, monkeypatch, name, replacement, reason
):
    assert find_free_space(tmp_path).obstacle == ""
    monkeypatch.setattr(os, name, replacement)
    space = find_free_space(tmp_path)
    with pytest.raises(RunError, match=f"{reason}.*or choose another folder in bench.toml; nothing was started"):
        check_space(space, 0)
    assert reason in SpaceMonitor(tmp_path).describe()

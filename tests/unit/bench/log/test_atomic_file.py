"""Files that appear complete or not at all."""

import pytest

from bench.errors import LogError
from bench.log.atomic_file import write_atomically


def test_an_atomic_file_appears_only_when_it_is_complete(tmp_path):
    (tmp_path / "a.txt").write_text("before")
    with write_atomically(tmp_path / "a.txt") as partial:
        partial.write_text("after")
        assert (tmp_path / "a.txt").read_text() == "before"
    assert (tmp_path / "a.txt").read_text() == "after"


def test_a_failed_atomic_write_leaves_the_old_file_and_nothing_else(tmp_path):
    (tmp_path / "a.txt").write_text("before")

    def fail():
        with write_atomically(tmp_path / "a.txt") as partial:
            partial.write_text("half")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]
    assert (tmp_path / "a.txt").read_text() == "before"


def test_an_atomic_write_into_a_missing_folder_is_refused_first(tmp_path):
    with (
        pytest.raises(LogError, match=r"the folder .* does not exist; create it first"),
        write_atomically(tmp_path / "no" / "a"),
    ):
        pytest.fail("the write was started")

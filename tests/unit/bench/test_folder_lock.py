"""Lock of a data folder."""

import pytest

from bench.folder_lock import LOCK_FILE, hold_lock, is_locked


def test_a_lock_has_one_holder_until_it_is_released(tmp_path):
    assert not is_locked(tmp_path)
    with hold_lock(tmp_path) as is_free, hold_lock(tmp_path) as is_free_again:
        assert (is_free, is_free_again, is_locked(tmp_path)) == (True, False, True)
    assert not is_locked(tmp_path)
    with hold_lock(tmp_path) as is_free:
        assert is_free


def test_asking_for_a_lock_creates_no_file(tmp_path):
    is_locked(tmp_path)
    assert not (tmp_path / LOCK_FILE).exists()


def test_a_folder_that_is_missing_is_an_error_of_the_system(tmp_path):
    with pytest.raises(FileNotFoundError), hold_lock(tmp_path / "missing"):
        pass

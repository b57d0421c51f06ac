"""Objects of a store: transfer in blocks, time limit, and errors in words of ours."""

import hashlib
import threading

import fsspec
import pytest

from bench.errors import LogError
from bench.log_store import LogStoreError, LogStoreUnavailableError, objects
from bench.log_store.objects import hash_object, write_object


@pytest.fixture
def source(tmp_path, monkeypatch):
    """File of several blocks."""
    monkeypatch.setattr(objects, "BLOCK_SIZE", 1000)
    path = tmp_path / "source"
    path.write_bytes(bytes(range(256)) * 11)
    return path


def test_an_object_of_several_blocks_is_written_and_read_back(source, store):
    write_object(source, f"{store}/object")
    assert hash_object(f"{store}/object") == (hashlib.sha256(source.read_bytes()).hexdigest(), 2816)


def test_an_object_is_replaced(source, store):
    for content in (b"longer than the second", b"short"):
        source.write_bytes(content)
        write_object(source, f"{store}/object")
    assert hash_object(f"{store}/object") == (hashlib.sha256(b"short").hexdigest(), 5)


def test_a_missing_object_is_named(store):
    with pytest.raises(LogStoreError, match=f"{store}/none: there is no such object") as caught:
        hash_object(f"{store}/none")
    assert not isinstance(caught.value, LogStoreUnavailableError)


def test_a_folder_that_is_not_mounted_is_not_created(source, tmp_path):
    with pytest.raises(LogStoreUnavailableError, match="bucket or folder of the log store does not exist"):
        write_object(source, f"file://{tmp_path}/not-mounted/object")
    assert not (tmp_path / "not-mounted").exists()


def test_a_missing_source_is_no_failure_of_the_store(store, tmp_path):
    with pytest.raises(LogError, match="no such file") as caught:
        write_object(tmp_path / "none", f"{store}/object")
    assert not isinstance(caught.value, LogStoreError)


class RefusalError(Exception):
    """Error of a library."""


class FailingFile:
    closed = False

    def __init__(self, error):
        self.error = error

    def write(self, block):
        raise self.error

    def close(self):
        pytest.fail("closing would send the rest of the file")


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (PermissionError(13, "user hidden"), "refuses access; check its credentials"),
        (OSError(28, "hidden"), "fails: no space left on device"),
        (TimeoutError("hidden"), "does not answer within 60 s"),
        (RefusalError("https://hidden"), r"cannot be reached \(RefusalError\)"),
    ],
)
def test_errors_of_libraries_are_replaced_by_words_without_endpoint_and_user(source, monkeypatch, error, words):
    file = FailingFile(error)
    monkeypatch.setattr(fsspec.get_filesystem_class("memory"), "open", lambda *given, **more: file)
    with pytest.raises(LogStoreUnavailableError, match=words) as caught:
        write_object(source, "memory://bucket/object")
    assert "hidden" not in str(caught.value)
    assert caught.value.__suppress_context__
    assert file.closed


def test_a_silent_store_is_given_up_after_the_time_limit(source, monkeypatch):
    answer = threading.Event()
    monkeypatch.setattr(objects, "TIME_LIMIT", 0.02)
    monkeypatch.setattr(
        fsspec.get_filesystem_class("memory"), "open", lambda *given, **more: answer.wait() and FailingFile(None)
    )
    with pytest.raises(LogStoreUnavailableError, match="does not answer"):
        write_object(source, "memory://bucket/object")
    answer.set()

"""Addresses of log stores: what is accepted, what is kept, and what is never shown."""

import pytest

from bench.log_store import LogStoreError, check_store_url, find_store, keep_store_url


@pytest.mark.parametrize("url", ["file:///mnt/logs", "memory://bucket/prefix", "s3://bucket/prefix"])
def test_a_url_is_accepted_with_and_without_a_slash_at_its_end(url):
    assert check_store_url(url) == check_store_url(f"{url}/") == url


@pytest.mark.parametrize(
    ("url", "why"),
    [
        ("/mnt/logs", "is not a URL with a bucket or folder"),
        ("s3://", "is not a URL with a bucket or folder"),
        ("s3://key:hidden@bucket", "contains a password or a query"),
        ("s3://bucket?secret=hidden", "contains a password or a query"),
        ("filecache::s3://bucket/hidden", "contains a password or a query"),
        ("s3://[hidden", "cannot be read"),
        ("unheard://hidden", "unheard:// is not known to fsspec"),
    ],
)
def test_another_address_is_refused_without_being_shown(url, why):
    with pytest.raises(LogStoreError, match=why) as caught:
        check_store_url(url)
    assert "hidden" not in str(caught.value)


def test_a_missing_package_is_named(monkeypatch):
    def fail(protocol):
        raise ImportError("Install s3fs to access S3")

    monkeypatch.setattr("fsspec.get_filesystem_class", fail)
    with pytest.raises(LogStoreError, match=r"pip install 'mrbench\[s3\]'"):
        check_store_url("s3://bucket")


def test_a_data_folder_keeps_the_address_until_another_is_given(tmp_path):
    assert find_store(tmp_path) is None
    for url in ("memory://first/", "memory://second"):
        keep_store_url(tmp_path, url)
        assert find_store(tmp_path) == url.rstrip("/")
    with pytest.raises(LogStoreError):
        keep_store_url(tmp_path, "/not/a/url")
    assert find_store(tmp_path) == "memory://second"
    assert [path.name for path in tmp_path.iterdir()] == ["logs.url"]

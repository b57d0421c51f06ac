"""Keys of requests in the catalogue."""

from datetime import UTC, datetime, timedelta

import pytest

from bench.catalogue import IdempotencyKeys, open_database

NOW = datetime(2026, 3, 1, 12, 0, 0, 123456, tzinfo=UTC)


@pytest.fixture
def keys(catalogue_url):
    engine = open_database(catalogue_url)
    yield IdempotencyKeys(engine)
    engine.dispose()


def test_a_claimed_key_keeps_its_first_request(keys):
    first = keys.claim("k", "POST /runs", "f" * 64, NOW)
    again = keys.claim("k", "POST /elsewhere", "0" * 64, NOW + timedelta(seconds=5))
    assert first == again
    assert (first.operation, first.created, first.status) == ("POST /runs", NOW, None)


def test_an_answer_is_kept_with_its_headers_and_body_hash(keys):
    keys.claim("k", "POST /runs", "f" * 64, NOW)
    keys.store("k", 201, {"location": "/runs/1"}, '{"id": "1"}')
    stored = keys.claim("k", "POST /runs", "f" * 64, NOW)
    assert (stored.fingerprint, stored.status, stored.answer) == ("f" * 64, 201, '{"id": "1"}')
    assert stored.headers == {"location": "/runs/1"}


def test_a_key_is_forgotten_after_a_day(keys):
    keys.claim("k", "POST /runs", "f" * 64, NOW)
    later = NOW + timedelta(hours=25)
    assert keys.claim("k", "POST /batches", "f" * 64, later).created == later

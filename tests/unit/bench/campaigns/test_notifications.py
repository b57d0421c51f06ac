"""Messages of stored campaigns: each is sent, repeated with a bound, and on record; no campaign waits for them."""

import threading
import time
from datetime import UTC, datetime, timedelta

import pytest

from bench.campaigns import (
    CampaignStore,
    NotificationSender,
    make_view,
    notifications,
    parse_campaign,
    send_due,
    stop,
)
from bench.campaigns.notifications import MAX_ATTEMPTS, RETRY_AFTER
from bench.catalogue import CampaignNotificationRow, Catalogue, open_database
from tests.support.message_servers import find_closed_port, serve_silence, serve_webhook


@pytest.fixture
def store(tmp_path, catalogue_url):
    catalogue = Catalogue(open_database(catalogue_url), tmp_path)
    yield CampaignStore(catalogue)
    catalogue.close()


def end_campaign(store, *addresses):
    """Add a campaign that has just been stopped, and return its id."""
    steps = [{"rest": {"seconds": 900}}]
    notify = [{"webhook": address} for address in addresses]
    document = parse_campaign({"name": "night", "steps": steps, "notify": notify}, "the test")
    campaign = store.create(document, {}, "agent", time.time())
    store.update(campaign.id, lambda state: stop(state, state.updated, "B"))
    return campaign.id


def list_notifications(store, campaign_id):
    view = make_view(store.get(campaign_id), store.table.list_newest_events(campaign_id, 200))
    return [one for event in view.events for one in event.notifications]


def pass_time(store, row_id=1):
    """Make the next attempt due now, and return how long it would have waited [s]."""
    with store.table._sessions.begin() as session:
        row = session.get_one(CampaignNotificationRow, row_id)
        waits = (row.next_attempt - datetime.now(UTC)).total_seconds()
        row.next_attempt = datetime.now(UTC) - timedelta(seconds=1)
    return waits


def test_each_recipient_is_told_of_the_end_once(store):
    with serve_webhook() as (first, received), serve_webhook() as (second, others):
        end_campaign(store, first, second)
        send_due(store)
        send_due(store)
    assert [one["kind"] for one in received + others] == ["ended", "ended"]
    assert "stopped on request" in received[0]["text"]
    assert received[0]["status"] == "stopped"


def test_a_failure_is_repeated_for_its_recipient_alone_until_it_is_sent(store):
    with serve_webhook() as (good, received), serve_webhook([503]) as (bad, others):
        campaign = end_campaign(store, good, bad)
        send_due(store)
        sent, due = list_notifications(store, campaign)
        assert (sent.state, due.state, due.attempts) == ("sent", "due", 1)
        assert due.reason.endswith("it answered 503 Service Unavailable")
        assert pass_time(store, 2) == pytest.approx(RETRY_AFTER[0], abs=5)
        send_due(store)
    assert [one.state for one in list_notifications(store, campaign)] == ["sent", "sent"]
    assert (len(received), len(others)) == (1, 2)
    assert others[0]["id"] == others[1]["id"]


def test_attempts_are_bounded_and_the_last_reason_stays(store):
    campaign = end_campaign(store, f"http://127.0.0.1:{find_closed_port()}/")
    waits = []
    for _ in range(MAX_ATTEMPTS + 2):
        send_due(store)
        (one,) = list_notifications(store, campaign)
        if one.state == "due":
            waits.append(pass_time(store))
    assert waits == pytest.approx(RETRY_AFTER, abs=5)
    assert (one.state, one.attempts, one.next_attempt) == ("failed", MAX_ATTEMPTS, None)
    assert "the connection was refused" in one.reason


def test_a_process_that_is_killed_while_it_sends_loses_nothing_and_is_bounded(store):
    now = datetime.now(UTC)
    with serve_webhook() as (address, received):
        campaign = end_campaign(store, address)
        assert store.table.claim_notification(now + timedelta(seconds=1), now + timedelta(minutes=1)) is not None
        send_due(store)
        assert received == []  # the other process may still be sending
        pass_time(store)
        send_due(store)
        assert [one.state for one in list_notifications(store, campaign)] == ["sent"]
        end_campaign(store, address)
        for _ in range(MAX_ATTEMPTS):
            later = datetime.now(UTC) + timedelta(seconds=1)
            assert store.table.claim_notification(later, later)
        time.sleep(1.1)
        send_due(store)
    assert len(received) == 1


def test_two_senders_send_a_message_once(store):
    with serve_webhook() as (address, received):
        for _ in range(8):
            end_campaign(store, address)
        threads = [threading.Thread(target=send_due, args=(store,)) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert len({one["id"] for one in received}) == len(received) == 8


def test_a_sender_sends_what_another_process_has_left(store, monkeypatch):
    monkeypatch.setattr(notifications, "PERIOD", 0.02)
    with serve_webhook() as (address, received), NotificationSender(store):
        end_campaign(store, address)
        deadline = time.monotonic() + 10
        while not received and time.monotonic() < deadline:
            time.sleep(0.01)
    assert received[0]["kind"] == "ended"


def test_a_silent_server_holds_up_the_sender_and_no_campaign(store, monkeypatch):
    monkeypatch.setattr("bench.campaigns.delivery.TIMEOUT", 1.0)
    with serve_silence() as port, NotificationSender(store):
        began = time.monotonic()
        campaign = end_campaign(store, f"http://127.0.0.1:{port}/")
        assert store.get(campaign).state.status == "stopped"
        assert time.monotonic() - began < 1.0

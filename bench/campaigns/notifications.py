"""Notifications of campaigns: on the end, on a stop, and when a person is needed.

An event and its messages are stored in one transaction. A sender delivers them in a thread of its own, so that no
campaign waits for a server. An attempt that fails is repeated with growing waits. The last failure stays on
record. A message may arrive twice if a process is killed while it sends; its `id` is then the same.
"""

import logging
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from typing import Any

from bench.campaigns.delivery import RECIPIENT, TIMEOUT, deliver
from bench.campaigns.document import Campaign, CampaignError, Recipient
from bench.campaigns.store import CampaignStore
from bench.catalogue import ClaimedNotification
from bench.log_lines import RepeatedFailure
from bench.threads import BackgroundThread

RETRY_AFTER = (10.0, 60.0, 300.0, 1800.0)
"""[s] Waits after each attempt that has failed; after the attempt that follows the last wait there is none."""
PERIOD = 1.0
"""[s] Time between two looks for messages that are due."""
MAX_ATTEMPTS = len(RETRY_AFTER) + 1
_CLAIM = timedelta(seconds=6 * TIMEOUT)
"""Time after which an attempt counts as lost with its process."""
_LOG = logging.getLogger(__name__)


class NotificationSender(BackgroundThread):
    """Thread that sends the messages of all campaigns of a catalogue."""

    def __init__(self, store: CampaignStore) -> None:
        super().__init__("notifications")
        self._store = store
        self._failures = RepeatedFailure(_LOG, "notifications_failed", "notifications_continue")

    def _run(self) -> None:
        while not self._stopping.is_set():
            try:
                while not self._stopping.is_set() and send_one(self._store):
                    pass
            except Exception as error:  # the thread must not end, or nobody would be told of anything
                self._failures.note(error)
            else:
                self._failures.clear()
            self._stopping.wait(PERIOD)


def send_due(store: CampaignStore) -> None:
    """Send the messages that are due now, each once."""
    while send_one(store):
        pass


def send_one(store: CampaignStore) -> bool:
    """Send the message that is due longest and record the result; return whether there was one."""
    now = datetime.now(UTC)
    claimed = store.table.claim_notification(now, now + _CLAIM)
    if claimed is None:
        return False
    row = claimed.notification
    if row.attempts > MAX_ATTEMPTS:
        store.table.record_attempt(row.id, "failed", "each attempt ended with its process")
        return True
    try:
        deliver(RECIPIENT.validate_python(row.recipient), _make_content(store, claimed))
    except CampaignError as error:
        _record_failure(store, claimed, str(error))
    else:
        store.table.record_attempt(row.id, "sent")
    return True


def _record_failure(store: CampaignStore, claimed: ClaimedNotification, reason: str) -> None:
    row = claimed.notification
    if row.attempts == MAX_ATTEMPTS:
        store.table.record_attempt(row.id, "failed", reason)
        _LOG.error("notification_failed", extra={"campaign": claimed.event.campaign_id, "why": reason})
        return
    wait = timedelta(seconds=RETRY_AFTER[row.attempts - 1])
    store.table.record_attempt(row.id, "due", reason, datetime.now(UTC) + wait)


def _make_content(store: CampaignStore, claimed: ClaimedNotification) -> dict[str, Any]:
    event = claimed.event
    return {
        "campaign": event.campaign_id,
        "id": claimed.notification.id,
        "kind": event.kind,
        "text": event.text,
        "at": event.at.isoformat(),
        "status": store.get(event.campaign_id).state.status,
    }


def send_test(document: Campaign) -> str:
    """Send a test message to the recipients of a campaign; return `sent`, or the reasons of failures.

    The campaign need not have started.

    Raises:
        CampaignError: it has no recipients.
    """
    if not document.notify:
        raise CampaignError(f"campaign {document.name} has no recipients; give it notify")
    return send_all(document.notify, make_test_content(document.name))


def make_test_content(name: str) -> dict[str, Any]:
    """Return the content of a test message."""
    return {"campaign": name, "kind": "test", "text": f"test message of campaign {name}; nothing has happened"}


def send_all(recipients: Sequence[Recipient], content: dict[str, Any]) -> str:
    """Send one message to all recipients at once, and once; return `sent`, or the reasons of failures."""
    with ThreadPoolExecutor(max_workers=min(len(recipients), 32) or 1) as pool:
        failures = [failure for failure in pool.map(lambda one: _try(one, content), recipients) if failure]
    return "; ".join(failures) or "sent"


def _try(recipient: Recipient, content: dict[str, Any]) -> str:
    try:
        deliver(recipient, content)
    except CampaignError as error:
        return str(error)
    return ""

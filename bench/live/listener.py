"""Messages that wait for one listener: a stalled one loses batches, and delays neither others nor the bench.

The operating system keeps much for a listener that reads nothing. A listener that acknowledges batches therefore
gets no further ones while many are unacknowledged. When it resumes, it gets the newest, and is told what was lost.

A listener that waits for batches is not slow, however many come at once. They do after the event loop was held up.
"""

import asyncio
import math
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import orjson

from bench.live.batch import MAX_SEQUENCE, Channel, LiveBatch
from bench.live.channels import describe_channels
from bench.live.decimation import decimate

MAX_QUEUED_EVENTS = 64
"""Largest number of events that wait for a slow listener."""
MAX_QUEUED_BATCHES = 8
"""Largest number of batches that wait for a slow listener; older ones are lost."""
MAX_BURST = 250
"""Largest number of batches that wait for a listener that is ready, after the service itself was held up."""
MAX_UNACKNOWLEDGED = 16
"""Number of unacknowledged batches above which a listener counts as stalled."""
_SLOW_AFTER = 3
"""Number of batches that came while a listener was not ready, above which it is slow and gets decimated ones."""
_SLOW_FACTOR = 4
"""Decimation for a slow listener."""


@dataclass(frozen=True)
class ListenerSettings:
    """Wishes of a listener."""

    rate_hz: float = math.inf
    """Largest rate of the samples [Hz]; a faster bench is decimated."""
    acknowledges: bool = False
    """True if it acknowledges the batches that it has handled."""


class Listener:
    """Messages for one listener; used in the event loop only.

    Args:
        settings: wishes of the listener.
        now: returns the UTC [s since 1970].
    """

    def __init__(self, settings: ListenerSettings, now: Callable[[], float] = time.time) -> None:
        self._settings, self._now = settings, now
        # Of a status, run or job only the latest state matters. Each event counts, up to a limit.
        self._latest: dict[tuple[str, str], str] = {}
        self._events: deque[str] = deque(maxlen=MAX_QUEUED_EVENTS)
        self._batches: deque[LiveBatch] = deque()
        self._late_batches = 0
        self._is_waiting = False
        self._unacknowledged: deque[int] = deque()
        self._channels: tuple[Channel, ...] | None = None
        self._last_sequence: int | None = None
        self._changed = asyncio.Event()

    def put(self, topic: str, key: str, text: str) -> None:
        """Add a message; of status, runs and jobs only the latest for each key is kept."""
        if topic == "event":
            self._events.append(text)
        else:
            self._latest[topic, key] = text
        self._changed.set()

    def put_batch(self, batch: LiveBatch) -> None:
        """Add a batch; the oldest one is lost if too many wait."""
        is_ready = self._is_waiting and not self._is_stalled
        self._late_batches += not is_ready
        self._batches.append(batch)
        if len(self._batches) > (MAX_BURST if is_ready else MAX_QUEUED_BATCHES):
            self._batches.popleft()
        self._changed.set()

    def acknowledge(self, sequence: int) -> None:
        """Note that the listener has handled a batch, and so all before it."""
        if sequence in self._unacknowledged:
            while self._unacknowledged.popleft() != sequence:
                pass
            self._changed.set()

    async def take(self) -> list[str | bytes]:
        """Wait for messages that may be sent, and remove and return all of them."""
        while not (due := [*self._latest.values(), *self._events, *self._take_batches()]):
            self._changed.clear()
            self._is_waiting = True
            await self._changed.wait()
            self._is_waiting = False
        self._latest.clear()
        self._events.clear()
        return due

    @property
    def _is_stalled(self) -> bool:
        return len(self._unacknowledged) > MAX_UNACKNOWLEDGED

    def _take_batches(self) -> Iterator[str | bytes]:
        if self._is_stalled:
            return
        least = _SLOW_FACTOR if self._late_batches > _SLOW_AFTER else 1
        self._late_batches = 0
        while self._batches:
            batch = self._batches.popleft()
            yield from self._announce(batch)
            if self._settings.acknowledges:
                self._unacknowledged.append(batch.sequence)
            factor = max(least, self._choose_factor(batch))
            yield decimate(batch, factor).encode()

    def _choose_factor(self, batch: LiveBatch) -> int:
        """Return the decimation that keeps the wished rate."""
        return max(1, math.ceil(1 / (self._settings.rate_hz * batch.period_s) - 1e-3)) if batch.period_s > 0 else 1

    def _announce(self, batch: LiveBatch) -> Iterator[str]:
        """Yield what a listener has to know before a batch: changed channels, lost batches, age of the data."""
        age = max(0.0, self._now() - batch.end_utc_s)
        if batch.channels != self._channels:
            self._channels = batch.channels
            yield _make_text("channels", {"channels": describe_channels(batch.channels), "age_s": age})
        lost = 0 if self._last_sequence is None else (batch.sequence - self._last_sequence - 1) & MAX_SEQUENCE
        # A restarted agent begins at zero, which is no loss.
        if 0 < lost <= MAX_SEQUENCE // 2:
            yield _make_text("lost", {"batches": lost, "age_s": age})
        self._last_sequence = batch.sequence


def _make_text(topic: str, data: dict[str, Any]) -> str:
    return orjson.dumps({"topic": topic, "data": data}).decode()

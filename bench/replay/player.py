"""Playback of the bench samples of a log to live views, in the batches that the agent publishes during a run."""

import math
import time
from collections.abc import Callable, Iterator
from typing import Protocol

import numpy as np

from bench.errors import LogError
from bench.live import BatchMaker, LiveBatch
from bench.log import SAMPLE_FIELDS, Log
from bench.replay.selection import Selection

PART_TIME = 0.05
"""[s] Recorded time in one batch."""


class PlaybackClock(Protocol):
    """UTC, and waiting."""

    def time(self) -> float:
        """Return the UTC [s since 1970]."""

    def sleep(self, seconds: float, /) -> None:
        """Wait for a time [s]."""


def parse_speed(text: str) -> float:
    """Parse a speed as a multiple of real time; infinite for ``max``.

    Raises:
        LogError: the text is neither ``max`` nor a number above zero.
    """
    try:
        speed = math.inf if text == "max" else float(text)
    except ValueError:
        speed = math.nan
    if not speed > 0:
        raise LogError(f"--speed {text}: give a number above 0, such as 1 or 10, or max")
    return speed


def divide(log: Log, parts: list[slice]) -> Iterator[tuple[float, slice]]:
    """Yield the time at which each short part is due [s], from the first sample, and its samples.

    The time between two chosen parts is left out.
    """
    elapsed = 0.0
    for part in parts:
        time_s = np.asarray(log.samples["time"][part], dtype=np.float64)
        time_s = time_s - time_s[0]
        edges = np.searchsorted(time_s, np.arange(0.0, time_s[-1] + PART_TIME, PART_TIME))
        for start, stop in zip(edges, [*edges[1:], len(time_s)], strict=True):
            if stop > start:
                yield elapsed + float(time_s[stop - 1]), slice(part.start + int(start), part.start + int(stop))
        elapsed += float(time_s[-1])


def play_log(
    log: Log,
    selection: Selection,
    speed: float,
    publish: Callable[[LiveBatch], None],
    clock: PlaybackClock = time,
) -> int:
    """Publish the chosen samples of a log and return their number.

    A live view judges the age of samples by their stamps. The stamps are therefore those of the playback.

    Args:
        log: the log.
        selection: chosen samples.
        speed: multiple of real time.
        publish: receives the batches.
        clock: UTC, and waiting.

    Raises:
        LogError: no sample is chosen.
    """
    maker = BatchMaker(log.metadata["units"])
    columns = {name: np.asarray(log.samples[name], np.float64) for name in SAMPLE_FIELDS if name in log.samples}
    count, began = 0, clock.time()
    stamp = began
    for due, part in divide(log, selection.find_parts(log)):
        clock.sleep(max(began + due / speed - clock.time(), 0.0))
        before, stamp = stamp, clock.time()
        size = part.stop - part.start
        time_ns = (np.linspace(before - began, stamp - began, size + 1)[1:] * 1e9).astype(np.int64)
        for batch in maker.make(time_ns, {name: column[part] for name, column in columns.items()}, began):
            publish(batch)
        count += size
    return count

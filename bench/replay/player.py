"""Plays the bench samples of a log to live views, as the agent publishes those of a run."""

import math
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from bench.agent_protocol import Publisher, Samples
from bench.errors import LogError
from bench.log import SAMPLE_FIELDS, Log, read_log

MESSAGE_PERIOD = 0.1
"""[s] of recorded time in one message."""


def parse_speed(text: str) -> float:
    """How many times as fast as recorded; infinite for ``max``.

    Raises:
        LogError: it is neither ``max`` nor a number above zero.
    """
    try:
        speed = math.inf if text == "max" else float(text)
    except ValueError:
        speed = math.nan
    if not speed > 0:
        raise LogError(f"--speed {text}: give a number above 0, such as 1 or 10, or max")
    return speed


def make_messages(log: Log) -> Iterator[tuple[float, Samples]]:
    """When each message is due, in recorded time from the first sample [s], and the message."""
    time_s = np.asarray(log.samples["time"], dtype=np.float64)
    edges = np.searchsorted(time_s, np.arange(0.0, time_s[-1] + MESSAGE_PERIOD, MESSAGE_PERIOD))
    names = [name for name in SAMPLE_FIELDS if name in log.samples and name != "segment"]
    segment = log.samples.get("segment")
    for start, stop in zip(edges, [*edges[1:], len(time_s)], strict=True):
        if stop > start:
            place = -1 if segment is None else int(segment[stop - 1])
            yield (
                float(time_s[stop - 1]),
                Samples(
                    time_ns=log.samples["time_ns"][start:stop].tolist(),
                    values={name: _make_list(log.samples[name][start:stop].tolist()) for name in names},
                    segment=next((one.name for one in log.segments if one.index == place), ""),
                ),
            )


def _make_list(column: list[float]) -> list[float | None]:
    return [value if value == value else None for value in column]


def play_log(path: Path, speed: float, address: str, wait: Callable[[float], None] = time.sleep) -> int:
    """Publish the samples of a log; returns how many.

    Args:
        path: of the log.
        speed: times as fast as it was recorded.
        address: where subscribers connect.
        wait: for so many seconds.

    Raises:
        LogError: the log cannot be read.
        RunError: the address cannot be had.
    """
    log = read_log(path)
    count = 0
    with Publisher(address) as publisher:
        began = time.monotonic()
        for due, message in make_messages(log):
            wait(max(began + due / speed - time.monotonic(), 0.0))
            publisher.publish(message)
            count += len(message.time_ns)
    return count

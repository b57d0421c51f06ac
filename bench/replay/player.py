"""Playback of the bench samples of a log to live views, in the messages that the agent publishes during a run."""

import math
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from bench.agent_protocol import Publisher, Samples
from bench.errors import LogError
from bench.log import SAMPLE_FIELDS, Log, read_log

MESSAGE_PERIOD = 0.1
"""[s] Recorded time in one message."""


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


def make_messages(log: Log) -> Iterator[tuple[float, Samples]]:
    """Yield the time at which each message is due [s], from the first sample, and the message."""
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


def play_log(path: Path, speed: float, address: str, key: Path, wait: Callable[[float], None] = time.sleep) -> int:
    """Publish the samples of a log and return their number.

    Args:
        path: file of the log.
        speed: multiple of real time.
        address: ZeroMQ address to which subscribers connect.
        key: key file of a TCP address, created unless it exists.
        wait: waits for a time [s].

    Raises:
        LogError: the log cannot be read.
        RunError: the address is not available.
        ConfigError: other users could reach the socket.
        SecretFileError: the key file cannot be created, or other users may read it.
    """
    log = read_log(path)
    count = 0
    with Publisher(address, key) as publisher:
        began = time.monotonic()
        for due, message in make_messages(log):
            wait(max(began + due / speed - time.monotonic(), 0.0))
            # A live view judges the age of samples by their stamp, and these are played now.
            publisher.publish(message.model_copy(update={"utc_s": time.time()}))
            count += len(message.time_ns)
    return count

"""Readings and frames as log messages, and back."""

import json

import numpy as np
import pytest

from bench.log.readings import make_frames_message, make_readings_messages, parse_blocks, parse_frames
from drivers import Frame, SampleBlock


class ShiftedClock:
    """A clock map that subtracts 100 ns."""

    def __init__(self, is_known=True):
        self.is_known = is_known

    def map_instants(self, device_ns):
        return np.asarray(device_ns, np.int64) - 100


def block(first, values, received_ns, device_ns=None, quality="good", channel="force"):
    device = None if device_ns is None else np.array(device_ns, np.int64)
    samples = np.array(values, float)
    return SampleBlock(channel, first, device, received_ns, samples, 10 * samples, quality)


def messages(*blocks, clock=None):
    return [(time, json.loads(text)) for time, text in make_readings_messages(blocks, clock)]


FIRST = block(5, [1, 2], 2_000_000_500, [110, 120])


@pytest.mark.parametrize(
    ("second", "parts"),
    [
        (block(7, [3], 2_000_000_900, [130]), [[5]]),
        (block(8, [3], 2_000_000_900, [130]), [[5], [8]]),
        (block(6, [3], 2_000_000_900, [130]), [[5], [6]]),
        (block(7, [3], 2_000_000_900, [130], quality="bad"), [[5], [7]]),
        (block(7, [3], 2_000_000_900), [[5], [7]]),
        (block(7, [3], 2_000_000_900, [130], channel="travel"), [[5], [7]]),
    ],
)
def test_only_contiguous_blocks_of_a_channel_share_a_message(second, parts):
    assert [[content["first"]] for _, content in messages(FIRST, second)] == parts


def test_times_in_a_message_count_from_the_bench_clock_of_its_first_sample():
    ((time, content),) = messages(FIRST, block(7, [3], 2_000_000_900, [130]))
    assert time == 2_000_000_500
    assert content["timestamp"] == {"sec": 2, "nsec": 500}
    assert (content["received"], content["bench"], content["device"]) == (
        [0, 0, 400],
        [0, 0, 400],
        [110, 120, 130],
    )


@pytest.mark.parametrize(("is_known", "time", "bench"), [(True, 10, [0, 10]), (False, 500, [0, 0])])
def test_a_known_clock_map_gives_the_times_of_the_samples(is_known, time, bench):
    ((begin, content),) = messages(block(0, [1, 2], 500, [110, 120]), clock=ShiftedClock(is_known))
    assert (begin, content["bench"]) == (time, bench)


def test_a_message_never_begins_before_the_bench_clock():
    ((begin, content),) = messages(block(0, [1, 2], 500, [60, 120]), clock=ShiftedClock())
    assert (begin, content["bench"], content["received"]) == (0, [-40, 20], [500, 500])


def test_blocks_are_restored_from_their_message():
    second = block(7, [np.nan, 4], 2_000_000_900, [130, 140])
    ((_, content),) = messages(FIRST, second)
    assert (content["missing"], content["values"]) == ([2], [1, 2, 0, 4])
    content["raw"][2] = 30.0  # JSON has no NaN
    for found, given in zip(parse_blocks(content), (FIRST, second), strict=True):
        assert (found.first, found.received_ns, found.quality) == (given.first, given.received_ns, given.quality)
        np.testing.assert_array_equal(found.device_ns, given.device_ns)
        np.testing.assert_array_equal(found.values, given.values)


def test_frames_are_restored_from_their_message():
    frames = [Frame(3_000_000_007, True, b"\x00\xff"), Frame(3_000_000_019, False, b"")]
    time, text = make_frames_message(frames)
    assert (time, json.loads(text)["at"]) == (3_000_000_007, [0, 12])
    assert parse_frames(json.loads(text)) == frames

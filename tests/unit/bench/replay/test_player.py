"""Playback of a log, choice of its samples, and comparison of readings."""

import math

import numpy as np
import pytest

from bench.errors import LogError
from bench.log import read_log
from bench.replay.compare import ReplayResult
from bench.replay.player import parse_speed, play_log
from bench.replay.selection import Selection
from tests.support.logs import write_log


@pytest.mark.parametrize(("text", "speed"), [("max", math.inf), ("0.5", 0.5), ("10", 10.0)])
def test_speed_is_a_multiple_of_real_time(text, speed):
    assert parse_speed(text) == speed


@pytest.mark.parametrize("text", ["0", "-1", "nan", "fast"])
def test_speed_that_is_not_above_zero_is_refused(text):
    with pytest.raises(LogError, match="give a number above 0"):
        parse_speed(text)


class StoppedClock:
    """Clock that advances only while somebody waits."""

    def __init__(self):
        self.now = 5000.0

    def time(self):
        return self.now

    def sleep(self, seconds):
        self.now += seconds


@pytest.fixture
def log(tmp_path):
    write_log(tmp_path / "run.mcap")
    return read_log(tmp_path / "run.mcap")


def play(log, speed=1.0, **selected):
    clock, batches = StoppedClock(), []
    count = play_log(log, Selection(**selected), speed, batches.append, clock)
    return count, batches, clock.now - 5000.0


def test_a_log_is_played_in_real_time_with_stamps_of_the_playback(log):
    count, batches, seconds = play(log)
    assert (count, seconds) == (1500, pytest.approx(2.998))
    force = [channel.name for channel in batches[0].channels].index("force")
    values = np.concatenate([one.values[force] for one in batches])
    np.testing.assert_array_equal(values, log.samples["force"].astype(np.float32))
    assert batches[0].channels[force].unit == "N"
    assert [one.sequence for one in batches] == list(range(len(batches)))
    assert batches[-1].end_utc_s == pytest.approx(5000.0 + 2.998, abs=1e-6)
    assert max(one.count * one.period_s for one in batches) < 0.06


def test_the_speed_shortens_waiting_and_stamps_alike(log):
    _, batches, seconds = play(log, speed=10.0)
    assert seconds == pytest.approx(0.2998)
    assert batches[-1].end_utc_s == pytest.approx(5000.2998, abs=1e-6)


def test_times_and_segments_choose_what_is_played(log):
    assert play(log, begin_s=1.0, end_s=1.5)[0] == pytest.approx(250, abs=1)
    inside = int(np.sum(log.samples["segment"] == 0))
    assert play(log, segment=log.segments[0].name[:4] + "*")[0] == inside
    assert play(log, segment=log.segments[0].stretch)[0] == sum(one.stop - one.start for one in log.segments)


def test_a_choice_without_samples_is_refused_with_what_the_log_has(log):
    with pytest.raises(LogError, match=r"no sample from 9 s to inf s; the log has 3\.0 s and the segments"):
        play(log, begin_s=9.0)
    with pytest.raises(LogError, match=f"in a segment 'x'; .*{log.segments[0].name}"):
        play(log, segment="x")


@pytest.mark.parametrize(
    ("frames", "samples", "differences", "is_equal"),
    [(5, 1, 0, True), (5, 0, 0, False), (0, 0, 0, True), (5, 9, 1, False), (1, 0, 0, False)],
)
def test_readings_are_equal_if_some_were_compared_and_none_differs(frames, samples, differences, is_equal):
    assert ReplayResult("load_cell", frames, samples, differences, "").is_equal == is_equal

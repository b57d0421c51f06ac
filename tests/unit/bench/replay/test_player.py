"""Messages of a played log, and comparison of readings."""

import math

import numpy as np
import pytest

from bench.errors import LogError
from bench.log import read_log
from bench.replay.compare import ReplayResult
from bench.replay.player import make_messages, parse_speed
from tests.support.logs import write_log


@pytest.mark.parametrize(("text", "speed"), [("max", math.inf), ("0.5", 0.5), ("10", 10.0)])
def test_speed_is_a_multiple_of_real_time(text, speed):
    assert parse_speed(text) == speed


@pytest.mark.parametrize("text", ["0", "-1", "nan", "fast"])
def test_speed_that_is_not_above_zero_is_refused(text):
    with pytest.raises(LogError, match="give a number above 0"):
        parse_speed(text)


def test_messages_hold_a_tenth_of_a_second_and_are_due_at_their_last_sample(tmp_path):
    write_log(tmp_path / "run.mcap")
    log = read_log(tmp_path / "run.mcap")
    due, messages = zip(*make_messages(log), strict=True)
    assert sum(len(message.time_ns) for message in messages) == 1500
    assert {len(message.time_ns) for message in messages} <= {49, 50, 51}
    assert list(due[:2]) == pytest.approx([0.098, 0.198], abs=0.0021)
    assert due[-1] == pytest.approx(2.998)
    assert [one for message in messages for one in message.time_ns] == log.samples["time_ns"].tolist()
    np.testing.assert_array_equal(messages[0].values["force"], log.samples["force"][: len(messages[0].time_ns)])
    assert "segment" not in messages[0].values
    assert [messages[k].segment for k in (0, 10, 25)] == ["", "10mm_1Hz_0.2V", ""]


@pytest.mark.parametrize(
    ("frames", "samples", "differences", "is_equal"),
    [(5, 1, 0, True), (5, 0, 0, False), (0, 0, 0, True), (5, 9, 1, False), (1, 0, 0, False)],
)
def test_readings_are_equal_if_some_were_compared_and_none_differs(frames, samples, differences, is_equal):
    assert ReplayResult("load_cell", frames, samples, differences, "").is_equal == is_equal

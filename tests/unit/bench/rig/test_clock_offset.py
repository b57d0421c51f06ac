"""Clock offset bounds from requests and replies with arbitrary delays."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from bench.rig.clock_offset import MAX_RATE_DRIFT, OffsetBound, estimate_offset_bounds

MS = 1_000_000
SECOND = 1_000_000_000
OFFSET = 77_000_000_000
DELAYS = st.lists(st.tuples(st.integers(0, 20 * MS), st.integers(0, 20 * MS)), min_size=2, max_size=40)


def find_offset(device_ns, rate=0.0):
    return OFFSET + device_ns * rate


def make_bounds(delays, rate=0.0, interval=SECOND // 10):
    """Return bounds from readings at equal intervals; delays [ns] of request and reply."""
    instants = [index * interval for index in range(len(delays))]
    offsets = [round(find_offset(instant, rate)) for instant in instants]
    requests, replies = zip(*delays, strict=True)
    lows = [OffsetBound(*one) for one in zip(instants, np.subtract(offsets, requests).tolist(), strict=True)]
    highs = [OffsetBound(*one) for one in zip(instants, np.add(offsets, replies).tolist(), strict=True)]
    return lows, highs, instants[-1]


@given(DELAYS, st.floats(-9e-4, 9e-4), st.integers(0, 5 * SECOND))
@example([(0, 0), (75_503, 0)], 0.0008300406470549177, 0)
@example([(0, 0), (0, 71_403)], -0.0007376035833924683, 0)
def test_true_offset_is_within_the_bounds_for_any_delays(delays, rate, ahead):
    lows, highs, now = make_bounds(delays, rate)
    bounds = estimate_offset_bounds(lows, highs, now)
    assert bounds is not None
    low, high = bounds.find_range(now + ahead)
    # The offsets of the readings are rounded to a nanosecond, and the rates between two of them accordingly.
    tolerance = 1 + 1e-8 * ahead
    assert low - tolerance <= find_offset(now + ahead, rate) <= high + tolerance


@given(DELAYS)
def test_estimate_is_within_its_own_bounds(delays):
    lows, highs, now = make_bounds(delays)
    bounds = estimate_offset_bounds(lows, highs, now)
    low, high = bounds.find_range(now)
    assert low <= bounds.estimate_offset(now) <= high
    assert bounds.rate_low <= bounds.rate <= bounds.rate_high


def test_short_delays_give_narrow_bounds_and_the_rate():
    lows, highs, now = make_bounds([(20_000, 60_000)] * 200, rate=-2e-4)
    bounds = estimate_offset_bounds(lows, highs, now)
    assert bounds.rate == pytest.approx(-2e-4, abs=5e-6)
    assert bounds.high - bounds.low < 0.2 * MS
    assert bounds.estimate_offset(now) == pytest.approx(find_offset(now, -2e-4), abs=50_000)


@pytest.mark.parametrize("seed", range(5))
def test_side_with_short_delays_determines_the_rate(seed):
    """An adapter delays the replies by up to 6 ms, but requests are fast."""
    random = np.random.default_rng(seed)
    requests = random.exponential(50_000, 200).astype(int)
    replies = random.uniform(1 * MS, 6 * MS, 200).astype(int)
    lows, highs, now = make_bounds(list(zip(requests.tolist(), replies.tolist(), strict=True)), rate=6e-5)
    bounds = estimate_offset_bounds(lows, highs, now)
    assert bounds.rate == pytest.approx(6e-5, abs=1e-5)
    assert bounds.estimate_offset(now) == pytest.approx(find_offset(now, 6e-5), abs=0.15 * MS)


def test_range_widens_with_the_time_ahead():
    lows, highs, now = make_bounds([(50_000, 150_000)] * 20)
    bounds = estimate_offset_bounds(lows, highs, now)
    widths = [high - low for low, high in (bounds.find_range(now + ahead) for ahead in (0, SECOND, 60 * SECOND))]
    assert widths == sorted(widths)
    assert widths[0] < widths[-1]


def test_old_bounds_are_widened_by_the_drift():
    """An old pair of equal bounds alone leaves the drift that was possible since then."""
    age = 20 * SECOND
    lows = [OffsetBound(0, OFFSET), OffsetBound(age, OFFSET - 10 * MS)]
    highs = [OffsetBound(0, OFFSET), OffsetBound(age, OFFSET + 10 * MS)]
    bounds = estimate_offset_bounds(lows, highs, age)
    assert bounds.offset_width == pytest.approx(2 * MAX_RATE_DRIFT * age, rel=1e-3)


def test_contradicting_bounds_have_no_line():
    lows = [OffsetBound(0, OFFSET), OffsetBound(MS, OFFSET + 5 * MS)]
    highs = [OffsetBound(0, OFFSET + 1_000), OffsetBound(MS, OFFSET + 6 * MS)]
    assert estimate_offset_bounds(lows, highs, MS) is None

"""Clock map of a device whose clock deviates, read over a wire with random delays."""

import numpy as np
import pytest

from bench.rig.clock_map import ClockMap
from drivers.channel import ClockReading
from tests.support.clock_wire import BENCH, ClockWire

MS = 1_000_000


def follow_clock(wire, seconds=40, every=0.05):
    """Return errors and bounds [ns] of samples taken every millisecond and converted 20 ms later."""
    clock, errors, bounds, mapped = ClockMap(), [], [], []
    last = wire.find_device_time(BENCH)
    for k in range(int(seconds / every)):
        reading = wire.read_clock(BENCH + int((k + wire.random.random()) * every * 1e9))
        clock.add_reading(reading)
        device = np.arange(last + MS, reading.device_ns - 20 * MS, MS)
        if device.size:
            last = int(device[-1])
            mapped.append(clock.map_instants(device))
            errors.append(mapped[-1] - wire.find_bench_time(device))
            bounds.append(np.full(device.size, clock.compute_error_bound() * 1e9))
    return np.concatenate(errors), np.concatenate(bounds), np.concatenate(mapped), clock


CASES = {
    "fast": ClockWire(47, lambda r: r.exponential(50e-6), lambda r: r.exponential(150e-6)),
    "slow clock, batches": ClockWire(-200, lambda r: 30e-6, lambda r: 1e-4 + r.uniform(0, 4e-3)),
    "outliers": ClockWire(200, lambda r: r.exponential(1e-4), lambda r: 2e-4 + 30e-3 * (r.random() < 0.2)),
    "all delay in the request": ClockWire(12, lambda r: 1e-3 + r.exponential(1e-4), lambda r: 10e-6),
    "far off": ClockWire(900, lambda r: r.exponential(1e-3), lambda r: r.exponential(1e-3)),
}


@pytest.mark.parametrize("name", CASES)
def test_error_bound_covers_the_errors(name):
    errors, bounds, _, clock = follow_clock(CASES[name])
    assert np.mean(np.abs(errors) <= bounds) >= 0.95
    assert clock.rejected_count == 0


@pytest.mark.parametrize("name", CASES)
def test_map_never_runs_back_and_never_jumps(name):
    _, _, mapped, _ = follow_clock(CASES[name])
    steps = np.diff(mapped)
    assert steps.min() > 0
    settled = steps[3000:]
    assert np.abs(settled - MS).max() <= MS * 2.1e-3


def test_errors_are_small_if_some_replies_are_fast():
    for name in ("fast", "slow clock, batches", "outliers"):
        errors, bounds, _, _ = follow_clock(CASES[name])
        assert np.percentile(np.abs(errors[5000:]), 95) < 0.1e6
        assert np.median(bounds[5000:]) < 0.3e6


def test_rate_is_estimated():
    clock = follow_clock(CASES["slow clock, batches"])[3]
    assert clock.estimate_rate() == pytest.approx(-200e-6, abs=10e-6)


def test_error_bound_grows_without_readings():
    wire = CASES["fast"]
    clock = follow_clock(wire, 10)[3]
    soon = clock.compute_error_bound()
    clock.map_instants([wire.find_device_time(BENCH + 100_000_000_000)])
    assert clock.compute_error_bound() > 5 * soon


def test_single_wrong_reading_is_rejected():
    wire = CASES["fast"]
    clock = follow_clock(wire, 10)[3]
    true = wire.read_clock(BENCH + 10_500 * MS)
    clock.add_reading(true._replace(device_ns=true.device_ns + 40 * MS))
    assert clock.rejected_count == 1
    device_ns = wire.find_device_time(BENCH + 10_600 * MS)
    assert abs(clock.map_instants([device_ns])[0] - wire.find_bench_time(device_ns)) < 0.1e6


def test_map_follows_a_clock_that_was_set():
    wire = CASES["fast"]
    clock = follow_clock(wire, 10)[3]
    for k in range(10):
        reading = wire.read_clock(BENCH + (11_000 + 100 * k) * MS)
        clock.add_reading(reading._replace(device_ns=reading.device_ns - 60_000 * MS))
    device_ns = wire.find_device_time(BENCH + 12_000 * MS)
    assert abs(clock.map_instants([device_ns - 60_000 * MS])[0] - wire.find_bench_time(device_ns)) < 0.5e6


def test_map_is_unknown_before_the_first_reading():
    clock = ClockMap()
    assert not clock.is_known
    assert clock.compute_error_bound() == float("inf")
    with pytest.raises(ValueError, match="never read"):
        clock.map_instants([1])


def test_converted_instants_do_not_change():
    wire = CASES["fast"]
    clock = follow_clock(wire, 5)[3]
    device_ns = wire.find_device_time(BENCH + 4_000 * MS)
    before = clock.map_instants([device_ns])
    for k in range(100):
        clock.add_reading(wire.read_clock(BENCH + (5_000 + 50 * k) * MS))
    assert clock.map_instants([device_ns]) == before


@pytest.mark.parametrize("seed", range(12))
def test_slow_replies_do_not_outweigh_fast_requests(seed):
    """An adapter delays replies by milliseconds, and the map must be accurate within a few seconds."""
    wire = ClockWire(60, lambda r: 3e-5 + r.exponential(1e-4), lambda r: 1e-3 + r.uniform(0, 5e-3), seed)
    errors = follow_clock(wire, 8, 0.1)[0]
    assert np.percentile(np.abs(errors[3000:]), 95) < 0.15e6


def test_samples_narrow_the_error_bound():
    wire = ClockWire(0, lambda r: 1e-4, lambda r: 8e-3)
    clock = follow_clock(wire, 3)[3]
    loose = clock.compute_error_bound()
    for k in range(3000, 4000):
        clock.add_sample(wire.find_device_time(BENCH + k * MS), BENCH + k * MS + 300_000)
        if k % 50 == 0:
            clock.add_reading(wire.read_clock(BENCH + k * MS))
    assert clock.compute_error_bound() < loose / 4


def test_sample_received_before_it_was_taken_is_ignored():
    wire = ClockWire(0, lambda r: 1e-4, lambda r: 1e-4)
    clock = follow_clock(wire, 3)[3]
    clock.add_sample(wire.find_device_time(BENCH + 4000 * MS), BENCH + 3000 * MS)
    clock.add_reading(wire.read_clock(BENCH + 4000 * MS))
    device_ns = wire.find_device_time(BENCH + 4010 * MS)
    assert abs(clock.map_instants([device_ns])[0] - wire.find_bench_time(device_ns)) < 0.1e6


def test_one_instant_is_converted_as_many_are():
    """This includes corrections, whose knots are in the future."""
    wire, clock = CASES["outliers"], ClockMap()
    for k in range(200):
        reading = wire.read_clock(BENCH + k * 50 * MS)
        clock.add_reading(reading)
        device_ns = np.arange(reading.device_ns - 40 * MS, reading.device_ns, 7 * MS)
        assert [clock.map_instant(int(one)) for one in device_ns] == clock.map_instants(device_ns).tolist()


def test_instant_of_an_unread_clock_is_refused():
    with pytest.raises(ValueError, match="never read"):
        ClockMap().map_instant(0)


def read_first(device_ns=1_000 * MS):
    """Return a map with one reading at device time 1 s: request at 5 s, reply 0.2 ms later.

    The device rounds down by up to 1 us, so the offset is within 4 s - 1 us and 4 s + 200 us.
    """
    clock = ClockMap()
    clock.add_reading(ClockReading(device_ns, 5_000 * MS, 5_000 * MS + 200_000))
    return clock


def test_first_estimate_is_at_the_request_share_of_the_exchange():
    """15 % of 201 us after the lower bound, so 29.15 us after the request; 170.85 us remain to the upper bound."""
    clock = read_first()
    assert clock.map_instant(1_000 * MS) == 5_000 * MS + 29_150
    assert clock.map_instants([1_000 * MS]).tolist() == [5_000 * MS + 29_150]
    assert clock.compute_error_bound() == pytest.approx(170.85e-6, rel=1e-9)
    assert clock.estimate_rate() == pytest.approx(0.0, abs=1e-9)


def test_request_share_of_a_slow_exchange_is_limited():
    clock = ClockMap()
    clock.add_reading(ClockReading(1_000 * MS, 5_000 * MS, 5_010 * MS))
    assert clock.map_instant(1_000 * MS) == 5_000 * MS - 1_000 + 100_000


@pytest.mark.parametrize(
    ("sent", "received", "rejected"),
    [(202_000, 300_000, 0), (202_001, 300_000, 1), (-300_000, -2_000, 0), (-300_000, -2_001, 1)],
)
def test_reading_contradicts_if_it_differs_by_more_than_the_resolution(sent, received, rejected):
    """Lower bound 200 us + 1 us + 1 us after the first request, upper bound 1 us + 1 us before it."""
    clock = read_first()
    clock.add_reading(ClockReading(1_000 * MS, 5_000 * MS + sent, 5_000 * MS + received))
    assert clock.rejected_count == rejected


@pytest.mark.parametrize(("step_ms", "jump_ms"), [(10_000, 10_000), (51, 51), (49, 0)])
def test_fifth_contradiction_in_a_row_replaces_the_readings(step_ms, jump_ms):
    """If the clock was set by more than 50 ms, the map jumps; otherwise it slews from the converted times."""
    clock = read_first()
    before = clock.map_instant(1_000 * MS)
    clock.map_instants([1_000 * MS])
    for k in range(5):
        assert clock.map_instant(1_000 * MS) == before
        sent = (5_000 + step_ms) * MS + 200_000 + k  # a repetition would be ignored
        clock.add_reading(ClockReading(1_000 * MS, sent, sent + 200_000))
    assert clock.rejected_count == 5
    assert abs(clock.map_instant(1_000 * MS) - before - jump_ms * MS) <= (250_000 if jump_ms else 0)


def test_consistent_reading_ends_a_row_of_contradictions():
    clock = read_first()
    before = clock.map_instant(1_000 * MS)
    for k in range(20):
        offset = 0 if k % 5 == 4 else 10_000 * MS
        clock.add_reading(ClockReading(1_000 * MS, 5_000 * MS + offset + k, 5_000 * MS + offset + 200_000))
    assert clock.rejected_count == 16
    assert abs(clock.map_instant(1_000 * MS) - before) < 1_000


def test_reply_before_its_request_is_ignored():
    clock = ClockMap()
    clock.add_reading(ClockReading(1_000 * MS, 5_000 * MS, 5_000 * MS - 1_001))
    assert not clock.is_known
    clock.add_reading(ClockReading(1_000 * MS, 5_000 * MS, 5_000 * MS - 1_000))
    assert clock.is_known


def test_restarted_map_is_unknown():
    clock = read_first()
    clock.restart()
    assert not clock.is_known
    assert clock.estimate_rate() == 0.0

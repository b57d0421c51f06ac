import numpy as np
import pytest

from bench.rig.clock_map import ClockMap
from drivers.channel import Stamp

BENCH = 5_000_000_000_000
DEVICE = 77_000_000_000
MS = 1_000_000


class Wire:
    """A device whose clock is off, asked over a wire with delays of its own."""

    def __init__(self, ppm, question, answer, seed=1):
        self.ppm, self._question, self._answer = ppm, question, answer
        self.random = np.random.default_rng(seed)

    def device(self, bench_ns):
        return DEVICE + int((bench_ns - BENCH) * (1 + self.ppm * 1e-6))

    def true(self, device_ns):
        return BENCH + (np.asarray(device_ns) - DEVICE) / (1 + self.ppm * 1e-6)

    def stamp(self, at_ns):
        read = at_ns + int(self._question(self.random) * 1e9)
        return Stamp(self.device(read) // 1000 * 1000, at_ns, read + int(self._answer(self.random) * 1e9))


def played(wire, seconds=40, every=0.05):
    """Errors and bounds [ns] of samples taken every millisecond, mapped 20 ms after they were made."""
    clock, errors, bounds, mapped = ClockMap(), [], [], []
    last = wire.device(BENCH)
    for k in range(int(seconds / every)):
        stamp = wire.stamp(BENCH + int((k + wire.random.random()) * every * 1e9))
        clock.feed(stamp)
        device = np.arange(last + MS, stamp.device_ns - 20 * MS, MS)
        if device.size:
            last = int(device[-1])
            mapped.append(clock.bench_ns(device))
            errors.append(mapped[-1] - wire.true(device))
            bounds.append(np.full(device.size, clock.skew() * 1e9))
    return np.concatenate(errors), np.concatenate(bounds), np.concatenate(mapped), clock


CASES = {
    "quick": Wire(47, lambda r: r.exponential(50e-6), lambda r: r.exponential(150e-6)),
    "slow clock, batches": Wire(-200, lambda r: 30e-6, lambda r: 1e-4 + r.uniform(0, 4e-3)),
    "outliers": Wire(200, lambda r: r.exponential(1e-4), lambda r: 2e-4 + 30e-3 * (r.random() < 0.2)),
    "all delay in the question": Wire(12, lambda r: 1e-3 + r.exponential(1e-4), lambda r: 10e-6),
    "far off": Wire(900, lambda r: r.exponential(1e-3), lambda r: r.exponential(1e-3)),
}


@pytest.mark.parametrize("name", CASES)
def test_the_bound_covers_what_is_left(name):
    errors, bounds, _, clock = played(CASES[name])
    assert np.mean(np.abs(errors) <= bounds) >= 0.95
    assert clock.rejected == 0


@pytest.mark.parametrize("name", CASES)
def test_the_mapping_never_runs_back_and_never_jumps(name):
    _, _, mapped, _ = played(CASES[name])
    steps = np.diff(mapped)
    assert steps.min() > 0
    settled = steps[3000:]
    assert np.abs(settled - MS).max() <= MS * 2.1e-3


def test_what_is_left_is_small_where_answers_are_quick_now_and_then():
    for name in ("quick", "slow clock, batches", "outliers"):
        errors, bounds, _, _ = played(CASES[name])
        assert np.percentile(np.abs(errors[5000:]), 95) < 0.1e6
        assert np.median(bounds[5000:]) < 0.3e6


def test_the_rate_is_found():
    clock = played(CASES["slow clock, batches"])[3]
    assert clock.rate() == pytest.approx(-200e-6, abs=10e-6)


def test_the_bound_grows_while_nobody_asks():
    wire = CASES["quick"]
    clock = played(wire, 10)[3]
    soon = clock.skew()
    clock.bench_ns([wire.device(BENCH + 100_000_000_000)])
    assert clock.skew() > 5 * soon


def test_one_false_stamp_is_not_used():
    wire = CASES["quick"]
    clock = played(wire, 10)[3]
    true = wire.stamp(BENCH + 10_500 * MS)
    clock.feed(true._replace(device_ns=true.device_ns + 40 * MS))
    assert clock.rejected == 1
    asked = wire.device(BENCH + 10_600 * MS)
    assert abs(clock.bench_ns([asked])[0] - wire.true(asked)) < 0.1e6


def test_a_clock_that_was_set_anew_is_followed():
    wire = CASES["quick"]
    clock = played(wire, 10)[3]
    for k in range(10):
        stamp = wire.stamp(BENCH + (11_000 + 100 * k) * MS)
        clock.feed(stamp._replace(device_ns=stamp.device_ns - 60_000 * MS))
    asked = wire.device(BENCH + 12_000 * MS)
    assert abs(clock.bench_ns([asked - 60_000 * MS])[0] - wire.true(asked)) < 0.5e6


def test_nothing_is_known_before_the_first_stamp():
    clock = ClockMap()
    assert not clock.known
    assert clock.skew() == float("inf")
    with pytest.raises(ValueError, match="never been read"):
        clock.bench_ns([1])


def test_the_same_instant_is_always_mapped_to_the_same():
    wire = CASES["quick"]
    clock = played(wire, 5)[3]
    asked = wire.device(BENCH + 4_000 * MS)
    before = clock.bench_ns([asked])
    for k in range(100):
        clock.feed(wire.stamp(BENCH + (5_000 + 50 * k) * MS))
    assert clock.bench_ns([asked]) == before


@pytest.mark.parametrize("seed", range(12))
def test_slow_answers_do_not_bend_what_quick_questions_know(seed):
    """An adapter holds answers back for milliseconds; a few seconds have to do before a run begins."""
    wire = Wire(60, lambda r: 3e-5 + r.exponential(1e-4), lambda r: 1e-3 + r.uniform(0, 5e-3), seed)
    errors = played(wire, 8, 0.1)[0]
    assert np.percentile(np.abs(errors[3000:]), 95) < 0.15e6


def test_a_sample_had_been_taken_before_it_came():
    wire = Wire(0, lambda r: 1e-4, lambda r: 8e-3)
    clock = played(wire, 3)[3]
    loose = clock.skew()
    for k in range(3000, 4000):
        clock.feed_sample(wire.device(BENCH + k * MS), BENCH + k * MS + 300_000)
        if k % 50 == 0:
            clock.feed(wire.stamp(BENCH + k * MS))
    assert clock.skew() < loose / 4


def test_a_sample_from_before_its_time_tells_nothing():
    wire = Wire(0, lambda r: 1e-4, lambda r: 1e-4)
    clock = played(wire, 3)[3]
    clock.feed_sample(wire.device(BENCH + 4000 * MS), BENCH + 3000 * MS)
    clock.feed(wire.stamp(BENCH + 4000 * MS))
    asked = wire.device(BENCH + 4010 * MS)
    assert abs(clock.bench_ns([asked])[0] - wire.true(asked)) < 0.1e6


def test_one_instant_is_mapped_as_many_are():
    """Over corrections, too, whose bends lie ahead."""
    wire, clock = CASES["outliers"], ClockMap()
    for k in range(200):
        stamp = wire.stamp(BENCH + k * 50 * MS)
        clock.feed(stamp)
        asked = np.arange(stamp.device_ns - 40 * MS, stamp.device_ns, 7 * MS)
        assert [clock.instant(int(one)) for one in asked] == clock.bench_ns(asked).tolist()


def test_one_instant_of_a_clock_never_read_is_refused():
    with pytest.raises(ValueError, match="never been read"):
        ClockMap().instant(0)

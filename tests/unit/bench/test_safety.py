"""Limits, interlocks and the way to rest: all on times and samples that are handed in."""

import threading
import time

import numpy as np
import pytest

from bench.errors import Interlocked
from bench.methods import load_method
from bench.safety.interlocks import Interlocks, following_error
from bench.safety.limits import Action, judge, specimen_matrix, stricter
from bench.safety.trip import bring_to_rest
from drivers.channel import Block
from drivers.errors import NoReply

MS = 1_000_000
FIXTURE = {
    "force": {Action.INDICATE: 500.0, Action.TRIP: 1000.0},
    "displacement": {Action.TRIP: 0.05},
    "coil_voltage": {Action.HOLD: 2.0},
    "force_age": {Action.TRIP: 0.1},
}


def block(channel, *values, received_ns=0, quality="good"):
    return Block(channel, 0, None, received_ns, np.array(values), np.array(values), quality)


@pytest.fixture
def interlocks():
    return Interlocks(FIXTURE, "coil_voltage")


@pytest.mark.parametrize(
    ("value", "action"),
    [(499.0, None), (-501.0, Action.INDICATE), (1000.0, Action.INDICATE), (-1001.0, Action.TRIP)],
)
def test_the_strongest_action_whose_limit_is_exceeded_is_asked_for_in_either_direction(value, action):
    verdict = judge(FIXTURE, "force", value)
    assert (verdict and verdict.action) == action


def test_the_stricter_of_two_tiers_wins_action_by_action():
    both = stricter(FIXTURE, {"force": {Action.INDICATE: 700.0, Action.TRIP: 900.0, Action.HOLD: 800.0}})
    assert both["force"] == {Action.INDICATE: 500.0, Action.HOLD: 800.0, Action.TRIP: 900.0}
    assert both["displacement"] == FIXTURE["displacement"]


def test_a_method_limits_what_it_says_it_limits():
    method = load_method("six_currents")
    matrix = specimen_matrix(method)
    assert judge(matrix, "force", 1.01 * method.limits.force_n).action is Action.CONTROLLED_STOP
    assert judge(matrix, "force", 1.3 * method.limits.force_n).action is Action.TRIP
    assert judge(matrix, "coil_current", 1.1 * method.limits.drive).action is Action.CONTROLLED_STOP
    assert judge(matrix, "coil_voltage", 24.0) is None
    assert judge(matrix, "displacement", method.limits.stroke_m) is None


def test_every_sample_of_a_block_is_judged(interlocks):
    verdicts = interlocks.check([block("force", 0.0, 2000.0, np.nan, 10.0)], 0)
    assert [(one.action, one.value) for one in verdicts] == [(Action.TRIP, 2000.0)]
    assert "2000 N exceeds the limit of 1000 N" in str(verdicts[0])


@pytest.mark.parametrize(
    ("quantity", "value", "words"),
    [
        ("following_error", -8.6991e-3, "following error -8.699 mm exceeds the limit of 8 mm"),
        ("setpoint_lateness", 0.0251, "setpoint lateness 25.1 ms exceeds the limit of 8 ms"),
    ],
)
def test_what_is_exceeded_is_said_in_units_of_its_size(quantity, value, words):
    assert str(judge({quantity: {Action.TRIP: 8e-3}}, quantity, value)) == words


def test_what_is_not_limited_is_let_pass(interlocks):
    assert interlocks.check([block("displacement", 9.0), block("force_raw", 1e6)], 0) == []


def test_a_limit_that_stays_exceeded_is_told_once_a_second(interlocks):
    told = [bool(interlocks.check([block("force", 600.0)], at * MS)) for at in (0, 10, 999, 1000, 1010)]
    assert told == [True, False, False, True, False]
    assert interlocks.check([block("force", 1600.0)], 20 * MS)[0].action is Action.TRIP


def test_force_that_stays_away_is_found_by_its_age(interlocks):
    assert interlocks.check((), 10_000 * MS) == []
    interlocks.expect_force(0)
    interlocks.check([block("force", 1.0, received_ns=80 * MS)], 80 * MS)
    assert interlocks.check((), 170 * MS) == []
    interlocks.check([block("force", 1.0, received_ns=170 * MS, quality="bad")], 170 * MS)
    assert [one.quantity for one in interlocks.check((), 190 * MS)] == ["force_age"]


@pytest.mark.parametrize("write", [{"position": 0.051}, {"position": float("nan")}, {"drive": -2.1}])
def test_the_last_word_before_a_write_is_no(interlocks, write):
    if "drive" in write:
        interlocks.permit(**write)  # a hold is no reason to refuse a setpoint
        interlocks.matrix = {"coil_voltage": {Action.CONTROLLED_STOP: 2.0}}
    with pytest.raises(Interlocked, match="nothing was sent"):
        interlocks.permit(**write)


def test_a_trip_is_latched_until_it_is_reset(interlocks):
    interlocks.permit(position=0.0)
    assert interlocks.latch("first cause")
    assert not interlocks.latch("second cause")
    with pytest.raises(Interlocked, match="first cause"):
        interlocks.permit(position=0.0)
    interlocks.reset()
    interlocks.permit(position=0.0, drive=1.0)


def test_only_one_of_many_threads_is_the_first_to_latch(interlocks):
    start, firsts = threading.Barrier(8), []

    def latch():
        start.wait()
        firsts.append(interlocks.latch("cause"))

    threads = [threading.Thread(target=latch) for _ in range(8)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    assert sum(firsts) == 1


def test_following_error_is_taken_at_each_samples_own_instant():
    times = [0, 4 * MS, 8 * MS]
    assert following_error([0.0, 0.003, 0.001], times, lambda t: t * 1e-9) == pytest.approx(-0.007)


class Stoppable:
    def __init__(self, name, work):
        self.name, self.make_safe = name, work


def test_neither_waits_for_the_other_on_the_way_to_rest():
    release = threading.Event()
    stopped = threading.Event()

    def refuses():
        raise NoReply("nobody there")

    hanging = Stoppable("hanging", lambda: release.wait(30))
    defect = Stoppable("defect", lambda: 1 / 0)
    began = time.monotonic()
    rest = bring_to_rest(
        [hanging, Stoppable("quick", stopped.set), Stoppable("dead", refuses), defect], within=0.2
    )
    assert time.monotonic() - began < 10
    release.set()
    assert stopped.is_set()
    assert list(rest.seconds) == ["quick"]
    assert "waited 0.2 s" in rest.failures["hanging"]
    assert rest.failures["dead"] == "nobody there"
    assert "division by zero" in rest.failures["defect"]
    assert "defect: ZeroDivisionError" in str(rest)

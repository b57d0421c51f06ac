"""Interlocks on times and samples that the test passes in."""

import sys
import threading

import numpy as np
import pytest

from bench.errors import InterlockError
from bench.safety.interlocks import Interlocks, compute_following_error
from bench.safety.limits import Action
from drivers.channel import SampleBlock

MS = 1_000_000
FIXTURE = {
    "force": {Action.INDICATE: 500.0, Action.TRIP: 1000.0},
    "displacement": {Action.TRIP: 0.05},
    "coil_voltage": {Action.HOLD: 2.0},
    "force_age": {Action.TRIP: 0.1},
}
SPECIMEN = {"displacement": {Action.CONTROLLED_STOP: 0.02}}


def block(channel, *values, received_ns=0, quality="good"):
    return SampleBlock(channel, 0, None, received_ns, np.array(values), np.array(values), quality)


@pytest.fixture
def interlocks():
    return Interlocks(FIXTURE, "coil_voltage")


def is_permitted(interlocks, position):
    try:
        interlocks.permit(position=position)
    except InterlockError:
        return False
    return True


def run_in_threads(*actions):
    """Run each action in a thread, all at the same time, with frequent switches between them."""
    start = threading.Barrier(len(actions))

    def run(action):
        start.wait()
        action()

    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        threads = [threading.Thread(target=run, args=(action,)) for action in actions]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        sys.setswitchinterval(interval)


class TestSamples:
    def test_every_sample_of_a_block_is_checked(self, interlocks):
        violations = interlocks.check([block("force", 0.0, 2000.0, np.nan, 10.0)], 0)
        assert [(one.action, one.value) for one in violations] == [(Action.TRIP, 2000.0)]
        assert "2000 N exceeds the limit of 1000 N" in str(violations[0])

    def test_channels_without_limits_pass(self, interlocks):
        assert interlocks.check([block("displacement", 9.0), block("force_raw", 1e6)], 0) == []

    def test_persistent_violation_is_reported_once_per_second(self, interlocks):
        reported = [bool(interlocks.check([block("force", 600.0)], at * MS)) for at in (0, 10, 999, 1000, 1010)]
        assert reported == [True, False, False, True, False]
        assert interlocks.check([block("force", 1600.0)], 20 * MS)[0].action is Action.TRIP

    def test_violation_is_reported_at_once_after_a_reset(self, interlocks):
        assert interlocks.check([block("force", 600.0)], 0)
        interlocks.reset()
        assert interlocks.check([block("force", 600.0)], MS)

    def test_following_error_is_evaluated_at_the_time_of_each_sample(self):
        times = [0, 4 * MS, 8 * MS]
        assert compute_following_error([0.0, 0.003, 0.001], times, lambda t: t * 1e-9) == pytest.approx(-0.007)


class TestForceAge:
    def test_missing_force_is_detected_by_its_age(self, interlocks):
        assert interlocks.check((), 10_000 * MS) == []
        with interlocks.expect_force(0):
            interlocks.check([block("force", 1.0, received_ns=80 * MS)], 80 * MS)
            assert interlocks.check((), 170 * MS) == []
            interlocks.check([block("force", 1.0, received_ns=170 * MS, quality="bad")], 170 * MS)
            assert [one.quantity for one in interlocks.check((), 190 * MS)] == ["force_age"]

    @pytest.mark.parametrize("error", [None, ZeroDivisionError])
    def test_age_is_not_limited_after_the_block(self, interlocks, error):
        try:
            with interlocks.expect_force(0):
                assert interlocks.compute_force_age(200 * MS) == pytest.approx(0.2)
                if error is not None:
                    raise error
        except ZeroDivisionError:
            pass
        interlocks.check([block("force", 1.0, received_ns=300 * MS)], 300 * MS)
        assert interlocks.compute_force_age(900 * MS) == 0.0
        assert interlocks.check((), 900 * MS) == []

    def test_inner_block_does_not_end_the_outer_one(self, interlocks):
        with interlocks.expect_force(0):
            with interlocks.expect_force(100 * MS):
                assert interlocks.compute_force_age(150 * MS) == pytest.approx(0.05)
            assert interlocks.compute_force_age(150 * MS) == pytest.approx(0.05)
        assert interlocks.compute_force_age(150 * MS) == 0.0

    def test_sample_that_arrives_while_the_block_ends_does_not_start_the_age_again(self, interlocks):
        """The block ends between the test whether force is expected and the assignment of its time."""
        scope = interlocks.expect_force(0)
        scope.__enter__()
        ending = threading.Thread(target=scope.__exit__, args=(None, None, None))

        class EndingBlock:
            channel, quality, values = "force", "good", np.array([1.0])

            @property
            def received_ns(self):
                ending.start()
                ending.join(0.05)
                return MS

        interlocks.check([EndingBlock()], MS)
        ending.join()
        assert interlocks.compute_force_age(10_000 * MS) == 0.0


class TestLimitScopes:
    def test_specimen_limits_apply_within_the_block_only(self, interlocks):
        with interlocks.use_limits(SPECIMEN):
            assert not is_permitted(interlocks, 0.03)
            assert not is_permitted(interlocks, 0.051)
        assert is_permitted(interlocks, 0.03)
        assert not is_permitted(interlocks, 0.051)

    def test_ignored_quantity_is_limited_again_after_the_block(self, interlocks):
        with interlocks.use_limits(ignore=("displacement",)):
            assert is_permitted(interlocks, 0.08)
            assert interlocks.check([block("actuator_position", 0.08)], 0) == []
            assert interlocks.check([block("force", 2000.0)], 0)[0].action is Action.TRIP
        assert not is_permitted(interlocks, 0.08)

    def test_ignoring_the_fixture_keeps_the_specimen(self, interlocks):
        with interlocks.use_limits(SPECIMEN), interlocks.use_limits(ignore=("displacement",)):
            assert not is_permitted(interlocks, 0.03)

    def test_exception_restores_the_limits(self, interlocks):
        with pytest.raises(ZeroDivisionError), interlocks.use_limits(SPECIMEN, ignore=("force",)):
            raise ZeroDivisionError
        assert is_permitted(interlocks, 0.03)
        assert interlocks.check([block("force", 2000.0)], 0)[0].action is Action.TRIP

    def test_inner_block_restores_the_limits_of_the_outer_one(self, interlocks):
        with interlocks.use_limits(SPECIMEN):
            with interlocks.use_limits({"displacement": {Action.TRIP: 0.001}}):
                assert not is_permitted(interlocks, 0.01)
            assert is_permitted(interlocks, 0.01)
            assert not is_permitted(interlocks, 0.03)

    def test_blocks_of_two_threads_may_end_in_any_order(self, interlocks):
        first, second = interlocks.use_limits(SPECIMEN), interlocks.use_limits(ignore=("displacement",))
        first.__enter__()
        second.__enter__()
        first.__exit__(None, None, None)
        assert is_permitted(interlocks, 0.08)
        second.__exit__(None, None, None)
        assert not is_permitted(interlocks, 0.08)

    def test_limits_are_the_fixtures_after_many_overlapping_blocks(self, interlocks):
        def change():
            for _ in range(300):
                with interlocks.use_limits(SPECIMEN), interlocks.use_limits(ignore=("displacement",)):
                    interlocks.permit(position=0.01)

        run_in_threads(change, change, change)
        assert is_permitted(interlocks, 0.03)
        assert not is_permitted(interlocks, 0.051)

    def test_later_change_of_the_given_matrix_has_no_effect(self):
        matrix = {"displacement": {Action.TRIP: 0.05}}
        interlocks = Interlocks(matrix, "coil_voltage")
        matrix["displacement"].clear()
        assert not is_permitted(interlocks, 0.051)


class TestCommands:
    @pytest.mark.parametrize("command", [{"position": 0.051}, {"position": float("nan")}, {"drive": -2.1}])
    def test_forbidden_command_is_refused(self, interlocks, command):
        if "drive" not in command:
            with pytest.raises(InterlockError, match="nothing was sent"):
                interlocks.permit(**command)
            return
        interlocks.permit(**command)  # a hold does not forbid a setpoint
        with (
            interlocks.use_limits({"coil_voltage": {Action.CONTROLLED_STOP: 2.0}}),
            pytest.raises(InterlockError, match="nothing was sent"),
        ):
            interlocks.permit(**command)

    def test_trip_is_latched_until_a_reset(self, interlocks):
        interlocks.permit(position=0.0)
        assert interlocks.latch("first cause")
        assert not interlocks.latch("second cause")
        with pytest.raises(InterlockError, match="first cause"):
            interlocks.permit(position=0.0)
        interlocks.reset()
        interlocks.permit(position=0.0, drive=1.0)

    def test_only_one_of_many_threads_latches_first(self, interlocks):
        first = []
        run_in_threads(*[lambda: first.append(interlocks.latch("cause"))] * 8)
        assert sum(first) == 1

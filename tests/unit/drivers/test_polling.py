import pytest

from drivers.polling import ACTUATOR_SCHEDULE, LOAD_CELL_SCHEDULE

MS = 1_000_000


@pytest.mark.parametrize("schedule", [ACTUATOR_SCHEDULE, LOAD_CELL_SCHEDULE])
@pytest.mark.parametrize("now", [0, 1, 3 * MS, 12_345_678_901])
def test_the_wait_ends_at_the_next_poll_of_the_schedule(schedule, now):
    wait = schedule.compute_wait(now)
    assert 0 < wait <= schedule.period_ns * 1e-9
    assert (now + round(wait * 1e9) - schedule.offset_ns) % schedule.period_ns == 0


def test_no_poll_coincides_with_the_setpoints_or_another_poll():
    """Setpoints leave at multiples of 4 ms; within a cycle each schedule has its own offset."""
    offsets = [schedule.offset_ns % (4 * MS) for schedule in (ACTUATOR_SCHEDULE, LOAD_CELL_SCHEDULE)]
    assert len(set(offsets)) == 2
    assert all(offset > 0 for offset in offsets)


@pytest.mark.parametrize(
    ("schedule", "now_ms", "wait_ms"),
    [
        (ACTUATOR_SCHEDULE, 0, 1.5), (ACTUATOR_SCHEDULE, 1.5, 8.0), (ACTUATOR_SCHEDULE, 2, 7.5),
        (LOAD_CELL_SCHEDULE, 0, 3.1), (LOAD_CELL_SCHEDULE, 3.1, 12.0), (LOAD_CELL_SCHEDULE, 20, 7.1),
    ],
)  # fmt: skip
def test_polls_are_at_fixed_milliseconds(schedule, now_ms, wait_ms):
    assert schedule.compute_wait(round(now_ms * MS)) == pytest.approx(wait_ms * 1e-3, abs=1e-9)

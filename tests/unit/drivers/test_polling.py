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

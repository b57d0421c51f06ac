import pytest

from drivers.beat import ACTUATOR, FORCE

MS = 1_000_000


@pytest.mark.parametrize("beat", [ACTUATOR, FORCE])
@pytest.mark.parametrize("now", [0, 1, 3 * MS, 12_345_678_901])
def test_whoever_waits_for_a_beat_wakes_on_it_within_one_turn(beat, now):
    wait = beat.wait(now)
    assert 0 < wait <= beat.every_ns * 1e-9
    assert (now + round(wait * 1e9) - beat.at_ns) % beat.every_ns == 0


def test_nobody_is_woken_with_the_setpoints_nor_with_another():
    """Setpoints leave at multiples of 4 ms; within a cycle each has a place of its own."""
    places = [beat.at_ns % (4 * MS) for beat in (ACTUATOR, FORCE)]
    assert len(set(places)) == 2
    assert all(place > 0 for place in places)

"""Checks of a recording before its diagnosis, and notes on effects that it cannot show."""

from dataclasses import replace

import numpy as np
import pytest

from identification.errors import UnusableDataError
from identification.fitting import Piece
from identification.gap.data.cycles import Cycles, StrokeCondition
from identification.gap.data.quality import (
    check_cycle_count,
    check_sliding_recorded,
    describe_unobservable_effects,
)
from identification.noise.noise_floor import NoiseFloorEstimate
from identification.simulate import Excitation

FLOOR = NoiseFloorEstimate(2.0, 2.0, 2.0, "cycle to cycle")


def make_cycles(count, *conditions):
    return Cycles(np.zeros(10, int), np.zeros(10), np.zeros(count, int), conditions)


def make_piece(velocity, train):
    zero = 0.0 * velocity
    return Piece("sine", Excitation(500.0, zero, velocity, zero, zero), zero, train)


def test_an_excluded_shock_does_not_raise_the_speed_of_the_stroke():
    velocity, train = 0.1 * np.sin(np.arange(4000) / 100.0), np.ones(4000)
    velocity[2000:2010], train[1990:2020] = 0.4, 0.0
    check_sliding_recorded([make_piece(velocity, train)])


def test_a_recording_without_force_at_speed_is_refused():
    velocity = 0.1 * np.sin(np.arange(4000) / 100.0)
    slow = make_piece(velocity, np.where(np.abs(velocity) > 0.04, 0.0, 1.0))
    with pytest.raises(UnusableDataError, match=r"no valid force was recorded above 0\.05 m/s"):
        check_sliding_recorded([slow])


def test_one_cycle_is_refused_and_four_are_enough():
    with pytest.raises(UnusableDataError, match="contains 1 cycle of the stroke; a diagnosis needs at least 4"):
        check_cycle_count(make_cycles(1))
    check_cycle_count(make_cycles(4))


def test_poor_strokes_are_noted():
    notes = " ".join(describe_unobservable_effects(make_cycles(6, StrokeCondition(0.0, 0.01, 1.0)), FLOOR))
    assert "one drive" in notes
    assert "one frequency" in notes
    assert "one amplitude" in notes


def test_rich_strokes_only_lack_a_calibration():
    strokes = StrokeCondition(0.0, 0.01, 1.0), StrokeCondition(0.2, 0.005, 3.0), StrokeCondition(0.0, 0.005, 3.0)
    rich = make_cycles(6, *strokes)
    (note,) = describe_unobservable_effects(rich, FLOOR)
    assert "calibration" in note


@pytest.mark.parametrize(
    ("drives", "noted"),
    [((0.0, 0.2, 0.4), True), ((0.0, 0.0, 0.4), True), ((0.0, 0.2, 0.0), False), ((0.2, 0.2), False)],
)
def test_drives_that_were_never_returned_to_are_noted(drives, noted):
    cycles = make_cycles(6, *(StrokeCondition(drive, 0.01, 1.0) for drive in drives))
    assert ("one stretch of time" in " ".join(describe_unobservable_effects(cycles, FLOOR))) == noted


def test_a_rest_does_not_return_to_its_drive():
    rest = StrokeCondition(0.0, 0.0, 0.0, is_stroke=False)
    cycles = make_cycles(6, StrokeCondition(0.0, 0.01, 1.0), StrokeCondition(0.2, 0.01, 1.0), rest)
    assert "one stretch of time" in " ".join(describe_unobservable_effects(cycles, FLOOR))


def test_a_floor_without_repeating_cycles_is_noted():
    floor = replace(FLOOR, cycle_to_cycle=None, basis="no cycles")
    notes = describe_unobservable_effects(make_cycles(6, StrokeCondition(0.0, 0.01, 0.0)), floor)
    assert any("high frequencies only: no cycles" in note for note in notes)


def test_force_that_does_not_repeat_is_noted():
    cycles = make_cycles(6, StrokeCondition(0.0, 0.01, 0.0))
    coloured = replace(FLOOR, noise=3.0, cycle_to_cycle=3.0, deviation=0.2)
    assert any(
        "1.50 times the noise at high frequencies" in n for n in describe_unobservable_effects(cycles, coloured)
    )
    uncertain = replace(coloured, deviation=0.6)
    for floor in (FLOOR, uncertain):
        assert not any("does not repeat" in note for note in describe_unobservable_effects(cycles, floor))


def test_one_piece_with_force_at_speed_is_enough_and_the_largest_limit_is_stated():
    fast, slow = (size * np.sin(np.arange(4000) / 100.0) for size in (0.2, 0.1))
    unmeasured = make_piece(fast, np.zeros(4000))
    check_sliding_recorded([unmeasured, make_piece(slow, np.ones(4000))])
    with pytest.raises(UnusableDataError, match=r"above 0\.1 m/s"):
        check_sliding_recorded([make_piece(slow, np.zeros(4000)), unmeasured])


@pytest.mark.parametrize("count", [0, 2, 3])
def test_fewer_than_four_cycles_are_refused(count):
    with pytest.raises(UnusableDataError, match=f"contains {count} cycles of"):
        check_cycle_count(make_cycles(count))


def test_strokes_that_agree_in_two_digits_count_as_one():
    alike = make_cycles(6, StrokeCondition(0.201, 0.01, 1.001), StrokeCondition(0.202, 0.01001, 1.002))
    assert len(describe_unobservable_effects(alike, FLOOR)) == 4
    two = make_cycles(6, StrokeCondition(0.2, 0.01, 1.0), StrokeCondition(0.21, 0.011, 0.0))
    (drive, frequency, _) = describe_unobservable_effects(two, FLOOR)
    assert "one stretch of time" in drive
    assert "one frequency" in frequency

"""Cycles of segments, and the cycles that are held out."""

import numpy as np
import pytest

from identification.fitting import Piece
from identification.gap.data.cycles import Cycles, StrokeCondition, cut_cycles, select_held_out_cycles
from identification.logs.recording import Segment
from identification.simulate import Excitation
from tests.support.strokes import stretch

RATE = 500.0


def record(segments=12, cycles=4, frequency=2.0):
    """A sine stroke whose drive changes from segment to segment, and its cycles."""
    length = round(cycles * RATE / frequency)
    time = np.arange(segments * length) / RATE
    x = 0.01 * np.sin(2 * np.pi * frequency * time)
    drive = np.repeat(np.arange(segments) % 3 * 0.2, length)
    parts = [
        Segment(k, f"s{k}", k * length, (k + 1) * length, "sine", 0.01, frequency, float(drive[k * length]))
        for k in range(segments)
    ]
    recorded = stretch(x, 0.0 * x, drive, parts, rate=RATE)
    piece = Piece("sine", Excitation(RATE, x, 0.0 * x, 0.0 * x, drive), 0.0 * x, np.ones(len(x)))
    return recorded, cut_cycles([recorded], [piece])


def test_every_period_of_every_segment_is_a_cycle():
    recorded, cycles = record()
    assert cycles.count == 12 * 4
    assert len(cycles.conditions) == 12
    counts = np.bincount(cycles.cycle)
    assert counts.min() >= 0.9 * RATE / 2.0
    assert counts.sum() == len(recorded.time)


def test_strokes_of_one_amplitude_and_frequency_count_once():
    assert record()[1].stroke_count == 1


def test_phase_is_a_quarter_at_the_extended_end():
    recorded, cycles = record()
    assert cycles.phase[np.argmax(recorded.displacement)] == pytest.approx(0.25, abs=0.01)


def test_values_are_summed_over_the_selected_samples_of_each_cycle():
    recorded, cycles = record(segments=2)
    first_half = recorded.time < recorded.time[-1] / 2.0
    sums = cycles.sum_by_cycle(np.ones(len(recorded.time)), first_half)
    assert sums.tolist() == [RATE / 2.0] * 4 + [0.0] * 4


def test_a_stretch_without_segments_is_one_segment_whose_motion_does_not_repeat():
    x = 0.01 * np.sin(2 * np.pi * np.arange(2250) / RATE)
    piece = Piece("one", Excitation(RATE, x, np.gradient(x) * RATE, 0.0 * x, 0.0 * x), 0.0 * x, np.ones(len(x)))
    cycles = cut_cycles([stretch(x, rate=RATE)], [piece])
    assert np.bincount(cycles.cycle)[:-1] == pytest.approx(RATE, rel=0.02)
    assert cycles.count == 4
    assert cycles.conditions[0].frequency == 0.0


def test_of_many_segments_every_fourth_is_held_out():
    _, cycles = record(segments=12)
    held_out = select_held_out_cycles(cycles)
    assert all(len(set(held_out[cycles.segment == k])) == 1 for k in range(12))
    assert 0.2 < held_out.mean() < 0.3


def test_of_few_segments_every_fourth_cycle_is_held_out():
    _, cycles = record(segments=3, cycles=6)
    held_out = select_held_out_cycles(cycles)
    assert all({True, False} == set(held_out[cycles.segment == k]) for k in range(3))


def test_of_few_segments_some_cycle_after_a_step_of_the_drive_is_held_out():
    _, cycles = record(segments=5, cycles=6)
    held_out = select_held_out_cycles(cycles)
    first = [int(np.flatnonzero(cycles.segment == k)[0]) for k in range(5)]
    assert 0 < np.count_nonzero(held_out[first]) < 5


def cut_one(segment, x, rate=100.0, drive=None):
    """Cycles of one stretch with one segment."""
    drive = 0.0 * x if drive is None else drive
    piece = Piece("one", Excitation(rate, x, np.gradient(x) * rate, 0.0 * x, drive), 0.0 * x, np.ones(len(x)))
    return cut_cycles([stretch(x, drive=drive, segments=[segment], rate=rate)], [piece])


@pytest.mark.parametrize(
    ("count", "last"), [(60, 0), (189, 0), (190, 1), (289, 1), (290, 2)]
)  # one cycle is 100 samples; a tenth of it may be missing
def test_a_last_cycle_counts_if_at_most_a_tenth_is_missing(count, last):
    x = np.sin(2 * np.pi * np.arange(count) / 100.0)
    cycles = cut_one(Segment(0, "s", 0, count, "sine", 1.0, 1.0, None), x)
    assert cycles.cycle[-1] == last
    assert cycles.count == last + 1


@pytest.mark.parametrize(("motion", "frequency"), [("ramp", 2.0), ("sine", None)])
@pytest.mark.parametrize(("rate", "size"), [(1.0, 0.01), (5.0, 0.3)])
def test_a_motion_that_does_not_repeat_has_cycles_as_long_as_a_sine_of_its_size_and_speed(
    motion, frequency, rate, size
):
    turns = rate * np.arange(250) / 100.0
    x = size * np.sin(2 * np.pi * turns)
    cycles = cut_one(Segment(0, "s", 0, 250, motion, None, frequency, None), x)
    # The peak speed is a quantile, a little below the largest.
    assert np.bincount(cycles.cycle)[:-1] == pytest.approx(100.0 / rate, rel=0.06)
    assert not cycles.phase.any()
    assert cycles.conditions == (StrokeCondition(0.0, pytest.approx(size, rel=0.01), 0.0),)


def test_less_than_a_cycle_without_periodic_motion_is_one_cycle():
    x = 0.01 * np.sin(2 * np.pi * np.arange(60) / 100.0)
    assert cut_one(Segment(0, "s", 0, 60, "ramp", None, None, None), x).count == 1


def test_a_stretch_at_rest_is_one_cycle():
    assert cut_one(Segment(0, "s", 0, 60, "rest", None, None, None), np.zeros(60)).count == 1


def test_a_condition_comes_from_the_segment_and_only_then_from_the_recording():
    x, drive = 0.02 * np.sin(2 * np.pi * np.arange(200) / 100.0), np.linspace(0.1, 0.3, 200)
    measured = cut_one(Segment(0, "s", 0, 200, "sine", None, 1.0, None), x, drive=drive)
    planned = cut_one(Segment(0, "s", 0, 200, "sine", 0.025, 1.0, 0.5), x, drive=drive)
    one = measured.conditions[0]
    assert (one.drive, one.amplitude, one.frequency) == pytest.approx((0.2, 0.02, 1.0))
    assert planned.conditions == (StrokeCondition(0.5, 0.025, 1.0),)


def test_samples_outside_all_segments_belong_to_no_cycle():
    x = np.sin(2 * np.pi * np.arange(400) / 100.0)
    cycles = cut_one(Segment(0, "s", 50, 250, "sine", 1.0, 1.0, None), x)
    assert set(cycles.cycle[:50]) == set(cycles.cycle[250:]) == {-1}
    assert np.bincount(cycles.cycle[50:250]).tolist() == [100, 100]
    # The segment begins half a cycle after the middle in extension.
    assert cycles.phase[[50, 75, 100, 125]] == pytest.approx([0.5, 0.75, 0.0, 0.25], abs=1e-9)
    assert cycles.sum_by_cycle(np.ones(400), np.ones(400, bool)).tolist() == [100.0, 100.0]


def make_cycles(segment, count, drives=None, strokes=None):
    """Cycles of segments, with the drive of each segment and whether it is a stroke."""
    conditions = tuple(
        StrokeCondition(d, 0.01, 1.0, s)
        for d, s in zip(drives or [0.0] * count, strokes or [True] * count, strict=True)
    )
    return Cycles(np.zeros(0, int), np.zeros(0), np.array(segment), conditions)


@pytest.mark.parametrize(
    # Of nine segments with two cycles each, cycle 0 of segments 2 and 6 and cycle 1 of segments 3 and 7.
    ("segments", "expected"),
    [(9, [4, 7, 12, 15]), (10, [4, 5, 12, 13])],
)
def test_from_ten_segments_on_whole_segments_are_held_out(segments, expected):
    held_out = select_held_out_cycles(make_cycles(np.repeat(np.arange(segments), 2), segments))
    assert np.flatnonzero(held_out).tolist() == expected


def test_of_few_segments_the_held_out_cycles_start_at_the_third_and_move_on_by_one():
    held_out = select_held_out_cycles(make_cycles(np.repeat([0, 1], 8), 2))
    assert np.flatnonzero(held_out).tolist() == [2, 6, 8 + 3, 8 + 7]


def test_of_two_cycles_the_second_is_held_out():
    assert select_held_out_cycles(make_cycles([0, 0], 1)).tolist() == [False, True]


def test_strokes_differ_by_amplitude_or_frequency_and_need_a_frequency():
    conditions = ((0.0, 0.01, 1.0), (0.5, 0.01, 1.0), (0.0, 0.02, 1.0), (0.0, 0.01, 2.0), (0.0, 0.03, 0.0))
    cycles = Cycles(
        np.zeros(0, int), np.zeros(0), np.zeros(5, int), tuple(StrokeCondition(*c) for c in conditions)
    )
    assert cycles.stroke_count == 3


@pytest.mark.parametrize(("drives", "strokes"), [(4, 3), (5, 9), (6, 6), (3, 4), (12, 1), (1, 12)])
def test_a_drive_is_held_out_and_fitted_as_well_where_it_repeats(drives, strokes):
    conditions = tuple(
        StrokeCondition(0.1 * d, 0.01 * (s + 1), 1.0) for s in range(strokes) for d in range(drives)
    )
    count = len(conditions)
    held_out = select_held_out_cycles(Cycles(np.zeros(0, int), np.zeros(0), np.arange(count), conditions))
    assert 0.2 <= held_out.mean() <= 0.35
    by_drive = [held_out[d::drives] for d in range(drives)]
    if strokes > 1:
        assert not any(part.all() for part in by_drive)
    assert sum(part.any() for part in by_drive) >= min(drives, 3)


def test_cycles_of_the_only_stroke_of_a_drive_are_held_out_not_the_whole_stroke():
    drives = [0.0] * 6 + [0.5] + [1.0] * 6
    for cycles_each in (2, 3, 4, 8):
        cycles = make_cycles(np.repeat(np.arange(13), cycles_each), 13, drives)
        held_out = select_held_out_cycles(cycles)
        counts = np.bincount(cycles.segment, held_out)
        assert counts[6] <= np.ceil(cycles_each / 4)
        assert set(np.delete(counts, 6)) == {0.0, float(cycles_each)}


def test_rests_are_fitted_and_do_not_count_as_strokes():
    strokes = [True, False] * 6
    cycles = make_cycles(np.repeat(np.arange(12), 8), 12, strokes=strokes)
    counts = np.bincount(cycles.segment, select_held_out_cycles(cycles))
    assert counts.tolist() == [2.0, 0.0] * 6


def test_a_recording_of_rests_alone_has_held_out_cycles():
    held_out = select_held_out_cycles(make_cycles([0] * 8, 1, strokes=[False]))
    assert np.flatnonzero(held_out).tolist() == [2, 6]


@pytest.mark.parametrize(
    ("motion", "x", "expected"),
    [
        ("hold", np.zeros(200), False),
        ("hold", 1e-6 * np.sin(np.arange(200)), False),
        ("ramp", np.linspace(-0.01, 0.01, 200), False),
        ("other", 0.01 * np.sin(np.linspace(0.0, np.pi, 200)), True),
        ("random", 0.01 * np.sin(np.linspace(0.0, 9.0, 200)), True),
        ("table", np.zeros(200), False),
    ],
)
def test_a_stroke_moves_and_returns(motion, x, expected):
    assert cut_one(Segment(0, "s", 0, 200, motion, None, None, None), x).conditions[0].is_stroke is expected

"""Cycles of segments, and the cycles that are held out."""

import numpy as np
import pytest

from identification.fitting import Piece
from identification.gap.data.cycles import cut_cycles, select_held_out_cycles
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


def test_without_segments_one_second_is_a_cycle():
    x = np.linspace(0.0, 0.01, 2250)
    piece = Piece("ramp", Excitation(RATE, x, 0.0 * x, 0.0 * x, 0.0 * x), 0.0 * x, np.ones(len(x)))
    cycles = cut_cycles([stretch(x, rate=RATE)], [piece])
    assert np.bincount(cycles.cycle).tolist() == [500, 500, 500, 750]
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

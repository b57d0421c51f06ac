"""Cycles in which the rod did not repeat its stroke are excluded."""

import numpy as np

from identification.fitting.piece import Piece
from identification.gap.data.cycles import cut_cycles
from identification.gap.data.disturbed_cycles import mask_disturbed_cycles, measure_disturbance
from identification.logs.recording import Segment
from identification.simulate import Excitation
from tests.support.strokes import stretch

RATE, CYCLES, SEGMENTS = 500.0, 8, 5


def make_strokes(jerk=0.0, disturbed=(), seed=1):
    """A piece of five segments of eight cycles, some with a jerk [m], and its cycles."""
    count = int(CYCLES * SEGMENTS * RATE / 2.0)
    time = np.arange(count) / RATE
    soft = np.clip(time / 0.4, 0.0, 1.0)
    soft = soft**3 * (10.0 - 15.0 * soft + 6.0 * soft**2)
    x = 0.01 * soft * np.sin(2.0 * np.pi * 2.0 * time)
    sizes = np.zeros(CYCLES * SEGMENTS)
    random = np.random.default_rng(seed)
    sizes[list(disturbed)] = (
        jerk * random.choice([-1.0, 1.0], len(disturbed)) * random.uniform(0.5, 2.0, len(disturbed))
    )
    turn = (2.0 * time) % 1.0
    x = x + sizes[(2.0 * time).astype(int)] * ((turn > 0.4) & (turn < 0.5))
    v = np.gradient(x) * RATE
    excitation = Excitation(RATE, x, v, np.gradient(v) * RATE, np.zeros(count))
    piece = Piece("rod", excitation, np.zeros(count), np.ones(count))
    length = count // SEGMENTS
    segments = [Segment(k, f"s{k}", k * length, (k + 1) * length, "sine", 0.01, 2.0, 0.0) for k in range(SEGMENTS)]
    return piece, cut_cycles([stretch(x, segments=segments, rate=RATE)], [piece])


def test_a_soft_start_is_not_a_disturbance():
    piece, cycles = make_strokes()
    assert np.nanmedian(measure_disturbance([piece], cycles)) < 1e-6
    (masked,), notes = mask_disturbed_cycles([piece], cycles)
    assert masked is piece
    assert notes == []


def test_disturbed_cycles_are_excluded_and_noted():
    disturbed = (10, 11, 12, 21)
    piece, cycles = make_strokes(1e-3, disturbed)
    (masked,), notes = mask_disturbed_cycles([piece], cycles)
    assert set(cycles.cycle[masked.train == 0.0]) == set(disturbed)
    assert np.count_nonzero(masked.train == 0.0) == len(disturbed) * RATE / 2.0
    assert "did not repeat its stroke in 4 of 40 cycles" in notes[0]
    assert "excluded" in notes[0]


def test_a_disturbance_across_the_end_of_a_segment_is_excluded():
    disturbed = (13, 14, 15, 16)
    piece, cycles = make_strokes(1e-3, disturbed)
    (masked,), _ = mask_disturbed_cycles([piece], cycles)
    assert set(cycles.cycle[masked.train == 0.0]) == set(disturbed)


def test_a_single_disturbed_cycle_at_the_start_of_a_segment_is_kept():
    piece, cycles = make_strokes(1e-3, (16,))
    (masked,), _ = mask_disturbed_cycles([piece], cycles)
    assert masked is piece


def test_a_recording_with_mostly_disturbed_cycles_is_kept_and_reported():
    piece, cycles = make_strokes(1e-3, range(8, 36))
    (masked,), notes = mask_disturbed_cycles([piece], cycles)
    assert masked is piece
    assert "record again" in notes[0]

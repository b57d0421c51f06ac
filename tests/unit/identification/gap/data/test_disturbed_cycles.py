"""Cycles in which the rod did not repeat its stroke are excluded."""

import numpy as np
import pytest

from identification.fitting.piece import Piece
from identification.gap.data.cycles import Cycles, StrokeCondition, cut_cycles
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


def test_the_note_states_the_jerks_in_micrometres():
    piece, cycles = make_strokes(1e-3, (10, 11, 12, 21))
    _, (note,) = mask_disturbed_cycles([piece], cycles)
    largest = 1e6 * np.nanmax(measure_disturbance([piece], cycles))
    assert 50.0 < largest < 2000.0
    # The limit is 0.004 of the standard deviation of the stroke.
    assert f"jerk up to {largest:.3g} µm, limit {4000.0 * np.std(piece.excitation.displacement):.2g} µm;" in note


def test_the_first_cycle_is_excluded_with_a_disturbed_neighbour():
    piece, cycles = make_strokes(2e-3, (0, 1))
    (masked,), _ = mask_disturbed_cycles([piece], cycles)
    assert set(cycles.cycle[masked.train == 0.0]) == {0, 1}


def repeat_stroke(cycles, samples=100, frequency=1.0, rounding=0.0):
    """Equal cycles of one segment; later cycles start a rounding error before their zero phase."""
    phase = np.tile(np.arange(samples) / samples, cycles)
    x = 0.01 * np.sin(2 * np.pi * phase)
    phase[samples::samples] = (phase[samples::samples] - rounding) % 1.0
    zero = 0.0 * x
    numbers = np.repeat(np.arange(cycles), samples)
    piece = Piece("rod", Excitation(RATE, x, zero, zero, zero), zero, np.ones(len(x)))
    return piece, Cycles(numbers, phase, np.zeros(cycles, int), (StrokeCondition(0.0, 0.01, frequency),))


@pytest.mark.parametrize(
    ("cycles", "samples", "frequency", "known"),
    [(3, 100, 1.0, True), (2, 100, 1.0, False), (3, 100, 0.0, False), (3, 17, 1.0, True), (3, 16, 1.0, False)],
)
def test_cycles_are_compared_from_three_on_with_enough_samples_of_a_periodic_stroke(
    cycles, samples, frequency, known
):
    piece, made = repeat_stroke(cycles, samples, frequency)
    assert np.isfinite(measure_disturbance([piece], made)).all() == known
    assert np.isfinite(measure_disturbance([piece], made)).any() == known


def test_a_phase_rounded_to_below_zero_is_no_disturbance():
    piece, cycles = repeat_stroke(4, samples=60, rounding=1e-12)
    x = piece.excitation.displacement
    x[::60] += 1e-3  # the start of every cycle differs from the common motion
    assert measure_disturbance([piece], cycles) == pytest.approx(np.zeros(4), abs=1e-7)


def test_the_jerk_is_the_third_difference_of_a_cycle_against_the_median():
    piece, cycles = repeat_stroke(9, samples=50)
    piece.excitation.displacement[4 * 50 + 20] += 1e-4
    jerks = measure_disturbance([piece], cycles)
    # Half of the pulse falls into each of two bins. Third differences: half of 1, -2, 0, 2, -1 in 47 places.
    assert jerks[4] == pytest.approx(1e-4 * np.sqrt(2.5 / 47.0), rel=0.02)
    assert np.delete(jerks, 4).max() < 0.1 * jerks[4]


def test_a_motion_that_all_cycles_share_or_that_grows_steadily_is_no_disturbance():
    piece, cycles = repeat_stroke(4)
    x, trend = piece.excitation.displacement, np.linspace(-1.0, 1.0, 400)
    x += (
        0.002 * np.sin(12 * 2 * np.pi * cycles.phase)
        + 0.003 * trend
        + 0.004 * trend * np.cos(2 * np.pi * cycles.phase)
    )
    assert measure_disturbance([piece], cycles).max() < 1e-9

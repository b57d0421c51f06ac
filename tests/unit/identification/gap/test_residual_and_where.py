from types import SimpleNamespace

import numpy as np
import pytest
from numpy.random import default_rng

from identification.gap.held_out import Again, Judged, held_out_cycles, shrinkage
from identification.gap.residual import cut_cycles
from identification.gap.where import Left, drift, gap_map, harmonics
from identification.recordings import Segment, Stretch

RATE = 500.0
NOISE = 2.0


def recording(segments=12, cycles=4, frequency=2.0):
    length = round(cycles * RATE / frequency)
    time = np.arange(segments * length) / RATE
    x = 0.01 * np.sin(2 * np.pi * frequency * time)
    drive = np.repeat(np.arange(segments) % 3 * 0.2, length)
    parts = tuple(
        Segment(k, f"s{k}", k * length, (k + 1) * length, "sine", 0.01, frequency, float(drive[k * length]))
        for k in range(segments)
    )
    everywhere = np.ones(len(x), bool)
    stretch = Stretch("made up", time, RATE, x, 0 * x, drive, None, parts, None, None, 0.0, 0.0, 0.0, everywhere)
    piece = SimpleNamespace(stroke=SimpleNamespace(displacement=x, drive=drive, rate=RATE))
    return stretch, cut_cycles([stretch], [piece])


def left(stretch, residual, simulated=None):
    count = len(residual)
    return Left(
        residual,
        np.sin(np.arange(count)) if simulated is None else simulated,
        stretch.drive,
        stretch.time,
        np.ones(count, bool),
        ((count, stretch.rate),),
    )


def test_every_cycle_of_every_segment_is_one():
    stretch, cycles = recording()
    assert cycles.count == 12 * 4
    assert len(cycles.conditions) == 12
    counts = np.bincount(cycles.cycle)
    assert counts.min() >= 0.9 * RATE / 2.0
    assert counts.sum() == len(stretch.time)


def test_phase_is_a_quarter_at_the_extended_end():
    stretch, cycles = recording()
    assert cycles.phase[np.argmax(stretch.displacement)] == pytest.approx(0.25, abs=0.01)


def test_whole_segments_are_held_out_and_of_few_segments_cycles():
    _, many = recording(segments=12)
    held = held_out_cycles(many)
    per_segment = [set(held[many.segment == k]) for k in range(12)]
    assert all(len(states) == 1 for states in per_segment)
    assert 0.2 < held.mean() < 0.3
    _, few = recording(segments=3, cycles=6)
    held = held_out_cycles(few)
    assert all({True, False} == set(held[few.segment == k]) for k in range(3))


def test_of_few_segments_some_cycle_that_follows_a_step_of_the_drive_is_held_out():
    _, few = recording(segments=5, cycles=6)
    held = held_out_cycles(few)
    first = [int(np.flatnonzero(few.segment == k)[0]) for k in range(5)]
    assert 0 < np.count_nonzero(held[first]) < 5


def test_the_map_names_drive_and_phase_of_the_gap_and_takes_the_noise_off():
    stretch, cycles = recording()
    bump = 10.0 * ((stretch.drive > 0.3) & (np.abs(cycles.phase - 0.25) < 0.06))
    residual = bump + NOISE * default_rng(0).standard_normal(len(bump))
    found = gap_map(left(stretch, residual), cycles, NOISE)
    assert found[0].drive == pytest.approx(0.4)
    assert abs(found[0].phase - 0.25) < 0.1
    assert found[0].gap_n > 5.0
    assert all(place.gap_n < 1.0 for place in found if place.drive < 0.3)


def test_harmonics_of_the_stroke_are_told_by_their_order():
    stretch, cycles = recording()
    residual = 4.0 * np.sqrt(2.0) * np.cos(3 * 2 * np.pi * cycles.phase)
    lines = {line.order: line.rms_n for line in harmonics(left(stretch, residual), cycles)}
    assert lines[3] == pytest.approx(4.0, rel=0.02)
    assert lines[2] < 0.1


def test_drift_of_mean_and_size_and_a_free_line_are_told_apart():
    stretch, cycles = recording(segments=20)
    noise = NOISE * default_rng(1).standard_normal(len(stretch.time))
    rising = drift(left(stretch, 0.5 * stretch.time + noise), cycles)
    assert rising.slope_n_per_s == pytest.approx(0.5, rel=0.05)
    assert rising.line_hz is None
    force = 300.0 * np.sin(2 * np.pi * 2.0 * stretch.time)
    fading = drift(left(stretch, -0.1 * force * stretch.time / stretch.time[-1] + noise, force), cycles)
    assert fading.size_change == pytest.approx(-0.1, rel=0.1)
    humming = drift(left(stretch, 3.0 * np.sin(2 * np.pi * 50.3 * stretch.time) + noise), cycles)
    assert humming.line_hz == pytest.approx(50.3, abs=0.1)
    assert humming.line_n == pytest.approx(3.0, rel=0.1)


def judged(before, after, segments=5):
    counts, segment = np.full(len(before), 500.0), np.arange(len(before)) * segments // len(before)
    return Judged(counts * before, counts * after, counts, segment, segment % 4 == 2)


def gap_of(left, share, random, cycles=30):
    """Mean squares of cycles without and with effects that leave a share of the gap."""
    excess = left * random.uniform(0.5, 1.5, cycles)
    return judged(NOISE**2 + excess, NOISE**2 + share * excess * random.uniform(0.7, 1.3, cycles))


def again(*runs, held=0.0, before=9.0):
    """Mean squares [N²] that other runs' motion carries into the force, and the gap of the whole run."""
    return Again(held, held, np.array(runs or (0.0,)), NOISE**2 + before)


def test_shrinkage_has_an_interval_that_holds_it():
    found = shrinkage(gap_of(9.0, 0.02, default_rng(2)), NOISE, again(), strokes=5)
    assert found.value == pytest.approx(0.97, abs=0.015)
    low, high = found.ci95
    assert low < found.value < high
    assert high - low < 0.15


def test_what_is_claimed_is_what_the_errors_say():
    found = shrinkage(gap_of(9.0, 0.1, default_rng(2)), NOISE, again(0.4), strokes=5)
    closed = 1.0 - (found.after**2 - NOISE**2) / (found.before**2 - NOISE**2)
    assert found.value == pytest.approx(closed, abs=1e-9)


def test_few_strokes_and_a_noisy_motion_lower_the_claim_and_widen_the_interval():
    rich = shrinkage(gap_of(9.0, 0.1, default_rng(2)), NOISE, again(), strokes=5)
    poor = shrinkage(gap_of(9.0, 0.1, default_rng(2)), NOISE, again(), strokes=1)
    blurred = shrinkage(gap_of(9.0, 0.1, default_rng(2)), NOISE, again(0.5, 1.3), strokes=5)
    assert poor.value < rich.value
    assert poor.ci95[0] < rich.ci95[0] - 0.1
    assert blurred.value == pytest.approx(rich.value - 0.1, abs=0.02)
    assert blurred.ci95[0] < rich.ci95[0] - 0.05


def test_strokes_that_differ_widely_are_no_reason_to_claim_less():
    alike = judged(np.full(30, NOISE**2 + 9.0), np.full(30, NOISE**2 + 0.9))
    assert shrinkage(alike, NOISE, again(), strokes=50).value == pytest.approx(0.9, abs=0.01)


def test_one_bad_stroke_among_those_kept_out_is_one_of_all():
    strokes = gap_of(9.0, 0.02, default_rng(2))
    bad = strokes._replace(after=np.where(strokes.held, strokes.counts * NOISE**2 + 2700.0, strokes.after))
    kept_out = 1.0 - bad.means()[1] / 9.0 + NOISE**2 / 9.0
    found = shrinkage(bad, NOISE, again(), strokes=5)
    assert found.value > kept_out + 0.3
    assert found.ci95[0] < kept_out


def test_a_set_that_does_harm_on_the_strokes_kept_out_has_no_worth():
    strokes = gap_of(9.0, 0.02, default_rng(2))
    harm = strokes._replace(after=np.where(strokes.held, strokes.before + 1000.0, strokes.after))
    assert shrinkage(harm, NOISE, again(), strokes=5).worth < 0.0
    assert shrinkage(strokes, NOISE, again(), strokes=5).worth > 0.9


def test_a_motion_that_makes_more_than_the_gap_leaves_a_set_without_worth():
    gap = 0.1 * NOISE**2
    strokes = gap_of(gap, 0.2, default_rng(2))
    assert shrinkage(strokes, NOISE, again(1.2 * gap, before=gap), strokes=1).worth < 0.0
    assert shrinkage(strokes, NOISE, again(0.2 * gap, before=gap), strokes=1).worth > 0.0


def test_noise_of_the_motion_on_the_cycles_is_no_error_of_the_form():
    strokes = gap_of(9.0, 0.1, default_rng(2))
    plain, known = (shrinkage(strokes, NOISE, again(0.5, held=held), strokes=5) for held in (0.0, 0.5))
    assert known.value > plain.value + 0.03


def test_chance_below_the_floor_is_no_more_than_the_whole_gap():
    lucky = gap_of(1.0, 0.0, default_rng(2))
    lucky = lucky._replace(after=0.98 * lucky.after)
    found = shrinkage(lucky, NOISE, again(0.1, before=1.0), strokes=5)
    assert found.value == pytest.approx(0.9, abs=0.03)
    assert found.after > NOISE


def test_at_the_floor_there_is_nothing_to_shrink():
    found = shrinkage(judged(np.full(30, NOISE**2 * 1.02), np.full(30, NOISE**2)), NOISE, again(), strokes=5)
    assert found.value is None
    assert found.ci95 is None

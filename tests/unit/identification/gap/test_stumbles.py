"""A rod that did not repeat its stroke, and noise of the motion in the simulated force."""

from dataclasses import replace

import numpy as np
from made_up_runs import NOISE, run
from made_up_strokes import stretch

from identification.assemble import assemble
from identification.gap.carried import carried, replayed
from identification.gap.diagnose import diagnosed_problem
from identification.gap.judge import Judge
from identification.gap.residual import cut_cycles
from identification.gap.stumbles import cycle_to_cycle, left_out
from identification.piece import Piece
from identification.recordings import Segment
from identification.simulate import Stroke
from identification.start import starting_points

RATE, CYCLES, SEGMENTS = 500.0, 8, 5


def strokes(jerk=0.0, stumbling=(), seed=1):
    """A piece of five segments of eight cycles, some of which jerk by so many metres, and its cycles."""
    count = int(CYCLES * SEGMENTS * RATE / 2.0)
    time = np.arange(count) / RATE
    soft = np.clip(time / 0.4, 0.0, 1.0)
    soft = soft**3 * (10.0 - 15.0 * soft + 6.0 * soft**2)
    x = 0.01 * soft * np.sin(2.0 * np.pi * 2.0 * time)
    sizes = np.zeros(CYCLES * SEGMENTS)
    random = np.random.default_rng(seed)
    sizes[list(stumbling)] = (
        jerk * random.choice([-1.0, 1.0], len(stumbling)) * random.uniform(0.5, 2.0, len(stumbling))
    )
    turn = (2.0 * time) % 1.0
    x = x + sizes[(2.0 * time).astype(int)] * ((turn > 0.4) & (turn < 0.5))
    v = np.gradient(x) * RATE
    piece = Piece(
        "rod", Stroke(RATE, x, v, np.gradient(v) * RATE, np.zeros(count)), np.zeros(count), np.ones(count)
    )
    length = count // SEGMENTS
    segments = tuple(
        Segment(k, f"s{k}", k * length, (k + 1) * length, "sine", 0.01, 2.0, 0.0) for k in range(SEGMENTS)
    )
    return piece, cut_cycles([stretch(x, np.zeros(count), np.zeros(count), segments, rate=RATE)], [piece])


def test_a_sound_stroke_repeats_and_its_soft_start_is_no_stumble():
    piece, cycles = strokes()
    assert np.nanmedian(cycle_to_cycle([piece], cycles)) < 1e-6
    (kept,), notes = left_out([piece], cycles)
    assert kept is piece
    assert notes == []


def test_cycles_in_which_the_rod_stumbled_are_left_out_and_said():
    bad = (10, 11, 12, 21)
    piece, cycles = strokes(1e-3, bad)
    (kept,), notes = left_out([piece], cycles)
    assert set(cycles.cycle[kept.train == 0.0]) == set(bad)
    assert np.count_nonzero(kept.train == 0.0) == len(bad) * RATE / 2.0
    assert "did not repeat its stroke in 4 of 40 cycles" in notes[0]
    assert "left out" in notes[0]


def test_a_stumble_that_goes_on_over_the_end_of_a_segment_is_left_out_there_too():
    bad = (13, 14, 15, 16)
    piece, cycles = strokes(1e-3, bad)
    (kept,), _ = left_out([piece], cycles)
    assert set(cycles.cycle[kept.train == 0.0]) == set(bad)
    piece, cycles = strokes(1e-3, (16,))
    (kept,), _ = left_out([piece], cycles)
    assert kept is piece


def test_where_most_cycles_stumble_all_are_kept_and_the_recording_is_called_bad():
    piece, cycles = strokes(1e-3, range(8, 36))
    (kept,), notes = left_out([piece], cycles)
    assert kept is piece
    assert "record again" in notes[0]


def test_noise_of_the_motion_becomes_force_in_proportion():
    sound = assemble([run()])
    judge = Judge.of(sound)
    problem = diagnosed_problem(sound, judge.fitted_pieces())
    start = starting_points(problem)[0]
    forces = problem.simulate(start)
    draws = replayed(sound.stretches, problem.pieces, forces, NOISE, 1, range(2))
    squares = carried(problem, start, draws)
    assert squares.shape == (2, len(judge.force))
    size = np.sqrt(squares[:, judge.seen].mean())
    assert 0.0 < size < 0.5 * NOISE
    (recorded,) = sound.stretches
    shaken = recorded.displacement + 6e-6 * np.random.default_rng(3).standard_normal(len(recorded.time))
    louder = replayed([replace(recorded, displacement=shaken)], problem.pieces, forces, NOISE, 1, range(2))
    assert np.sqrt(carried(problem, start, louder)[:, judge.seen].mean()) > 1.5 * size

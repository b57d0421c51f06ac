"""Instants of drive steps: found from the force between two samples, and left alone where chance explains them."""

from dataclasses import replace

import numpy as np
import pytest

from identification.fitting.piece import Piece
from identification.fitting.problem import Problem
from identification.fitting.search_space import SearchSpace
from identification.signals import StepShifts, find_level_changes
from identification.simulate import Excitation, SimulationModel, simulate
from identification.uncertainty import estimate_step_shifts, shift_steps
from tests.support.fit_problems import LABORATORY, NOISE, RATE, SCALES

FINE = 20
"""Parts of a sample at which the drive may step."""
COUNT, STEPS = 8000, 24


def make_problem(advances, noise=NOISE):
    """Return the problem of a sine whose drive steps earlier than recorded, and unknowns at the true law."""
    time = np.arange(COUNT) / RATE
    x, v, a = (0.01 * (2 * np.pi * 2.0) ** k * np.sin(2 * np.pi * 2.0 * time + k * np.pi / 2) for k in range(3))
    places = np.linspace(200, COUNT - 200, STEPS).astype(int)
    levels = np.random.default_rng(3).permutation(np.tile([0.0, 0.2, 0.35, 0.5], STEPS // 4 + 1))[: STEPS + 1]
    levels[1:][np.diff(levels) == 0.0] += 0.05
    instants = np.round((places - advances) * FINE).astype(int)
    drive = levels[np.searchsorted(instants, np.arange((COUNT - 1) * FINE + 1), side="right")]
    true = Excitation(RATE, x, v, a, drive, drive_oversampling=FINE)
    force = simulate(SimulationModel(LABORATORY), true).force
    force += noise * np.random.default_rng(5).standard_normal(COUNT)
    recorded = replace(true, drive=drive[::FINE], drive_oversampling=1)
    piece = Piece("sine", recorded, force, np.ones(COUNT))
    problem = Problem((piece,), SearchSpace(0.0, 0.5, SCALES), NOISE, 20e-6)
    return problem, problem.make_start(LABORATORY), places


@pytest.fixture(scope="module")
def advances():
    return np.random.default_rng(4).uniform(0.0, 0.95, STEPS)


def test_instants_between_samples_are_found(advances):
    problem, unknowns, places = make_problem(advances)
    found = estimate_step_shifts(problem, unknowns)
    assert found is not None
    assert np.array_equal(found[0].places, places)
    error = found[0].advances - advances
    # The differences between steps are found, not the shift that all have in common.
    assert np.std(error) < 0.35 * np.std(advances)


def test_the_force_after_the_steps_is_then_that_of_the_law(advances):
    problem, unknowns, _ = make_problem(advances)
    found = estimate_step_shifts(problem, unknowns)
    before, after = (
        float(np.sqrt(np.mean((p.simulate(unknowns)[0] - p.pieces[0].force) ** 2)))
        for p in (problem, shift_steps(problem, found))
    )
    assert before > 1.3 * NOISE
    assert after < 1.05 * NOISE


@pytest.mark.parametrize("common", [0.0, 0.5])
def test_steps_that_all_have_one_shift_stay_as_recorded(common):
    problem, unknowns, _ = make_problem(np.full(STEPS, common))
    assert estimate_step_shifts(problem, unknowns) is None


def test_noise_that_hides_the_shifts_leaves_the_drive_as_recorded(advances):
    problem, unknowns, _ = make_problem(advances, noise=100.0)
    assert estimate_step_shifts(problem, unknowns) is None


def test_held_out_samples_are_not_read(advances):
    problem, unknowns, places = make_problem(advances)
    piece = problem.pieces[0]
    fitted = np.arange(COUNT) < COUNT // 2
    half = replace(problem, pieces=(replace(piece, train=fitted.astype(float)),))
    other = replace(half, pieces=(replace(half.pieces[0], force=np.where(fitted, piece.force, 0.0)),))
    first, second = (estimate_step_shifts(p, unknowns)[0].advances for p in (half, other))
    assert first == pytest.approx(second, abs=1e-9)
    assert first[places > COUNT // 2 + 1] == pytest.approx(0.5)


def test_a_recording_that_is_held_out_whole_leaves_the_steps_of_the_others(advances):
    problem, unknowns, _ = make_problem(advances)
    piece = problem.pieces[0]
    both = replace(problem, pieces=(piece, replace(piece, train=np.zeros(COUNT))))
    start = both.make_start(LABORATORY)
    alone, found = estimate_step_shifts(problem, unknowns), estimate_step_shifts(both, start)
    assert found[0].advances == pytest.approx(alone[0].advances, abs=0.02)
    assert found[1].advances == pytest.approx(0.5)


def test_a_step_needs_constant_levels_on_both_sides():
    drive = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.5, 2.0, 2.0, 2.0, 2.0, 0.5, 0.5])
    assert list(find_level_changes(drive)) == [3, 11]


def test_a_shifted_step_has_the_mean_drive_in_its_sample():
    drive = np.array([0.0, 0.0, 0.0, 2.0, 2.0, 2.0])
    shifted = StepShifts(np.array([3]), np.array([0.25])).apply(drive)
    assert shifted == pytest.approx([0.0, 0.0, 0.5, 2.0, 2.0, 2.0])
    assert drive[2] == 0.0

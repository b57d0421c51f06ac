"""Replicas of input noise: a drive just beyond the recorded range must not make a coefficient negative."""

from dataclasses import replace

import numpy as np
import pytest

from identification.simulate import SimulationModel
from identification.uncertainty.input_noise import _limit_drive
from tests.support.fit_problems import LABORATORY, STROKES, problem_of

STEEP = LABORATORY._replace(c0_a=0.0, c0_b=5700.0, c1_a=0.0, c1_b=1e5)
"""Damper without damping at zero drive, as a fit of one coil voltage may end."""
LOWEST = 5e-5
"""Lowest recorded drive [V]."""


@pytest.fixture
def problem():
    return problem_of(LABORATORY, STROKES[:1], drives=(LOWEST, 0.5))


def limit(problem, coordinates, drive):
    unknowns = problem.make_start(coordinates)
    piece = problem.pieces[0]
    piece = replace(piece, excitation=replace(piece.excitation, drive=drive))
    return unknowns, piece, _limit_drive(problem, unknowns, piece)


def test_a_drive_at_which_a_damping_would_be_negative_stays_in_the_recorded_range(problem):
    drive = problem.pieces[0].excitation.drive.copy()
    drive[:1000] = -5e-5
    unknowns, piece, limited = limit(problem, STEEP, drive)
    assert np.all(limited.excitation.drive[:1000] == LOWEST)
    assert np.array_equal(limited.excitation.drive[drive > LOWEST], drive[drive > LOWEST])
    coordinates = problem.space.to_coordinates(unknowns[:13])
    model = SimulationModel(coordinates, 0.0)
    plain, _ = piece.simulate(model)
    assert not np.abs(plain).max() < 1e6  # infinite, or growing without limit
    assert np.abs(limited.simulate(model)[0]).max() < 1e4


def test_a_drive_beyond_the_range_is_kept_where_all_coefficients_are_positive(problem):
    drive = np.full_like(problem.pieces[0].excitation.drive, -5e-5)
    limited = limit(problem, LABORATORY, drive)[2]
    assert np.array_equal(limited.excitation.drive, drive)

"""A pool moves the steps of a drive to the instants between two samples that the force shows."""

import numpy as np
import pytest

from identification.gap import diagnose
from identification.gap.diagnosis import make_candidate_pool, prepare_recordings
from tests.support.candidate_pools import NOISE, fit_baseline, record

ADVANCES = (0.9, 0.1, 0.9, 0.0, 0.8)
"""Parts of a sample by which the steps are earlier than their first samples."""


@pytest.fixture(scope="module")
def recording():
    return record(advances=ADVANCES)


@pytest.fixture(scope="module")
def pool(recording):
    pool = make_candidate_pool(prepare_recordings([recording]))
    pool.fit_law()
    return pool


def test_moved_steps_leave_the_noise(pool):
    pool.fit_fully(frozenset())
    before, steps = pool.baseline, pool.problems.full.pieces[0].excitation.drive.copy()
    assert pool.place_drive_steps(before)
    moved = pool.problems.full.pieces[0].excitation.drive
    assert np.count_nonzero(moved != steps) == len(ADVANCES)
    assert np.array_equal(moved, pool.evaluation.pieces[0].excitation.drive)
    after = pool.fit((), [before.fit.minimum.unknowns])
    assert before.train_rmse > 1.15 * NOISE
    assert after.train_rmse < 1.03 * NOISE
    # Seen from the recorded drive again, the estimate stays where it is.
    assert pool.place_drive_steps(after)
    assert pool.problems.full.pieces[0].excitation.drive == pytest.approx(moved, abs=0.02)


def test_steps_at_the_samples_stay():
    pool = fit_baseline()
    problem, candidate = pool.problems.full, pool.baseline
    assert not pool.place_drive_steps(candidate)
    assert pool.problems.full is problem
    assert pool.baseline is candidate


def test_a_diagnosis_of_steps_between_samples_finds_no_gap(recording):
    found = diagnose([recording]).diagnosis
    assert found.verdict == "no_gap"
    assert found.gap.before_n == pytest.approx(NOISE, rel=0.05)

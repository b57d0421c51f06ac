"""Comparison of starts."""

from types import SimpleNamespace

import numpy as np
import pytest

from identification.pinn.common.result import TrainingRecord
from identification.pinn.elements import multistart
from identification.pinn.elements.trained_network import Misfit


def test_the_oscillation_is_the_change_of_the_misfit_on_the_last_mesh_of_a_phase():
    def record(phase, force):
        return TrainingRecord(0.0, phase, force, 0.0, 0.0)

    last = SimpleNamespace(phase="last", history=[record("first", 9.0), record("last", 4.0), record("last", 3.9)])
    assert multistart._measure_oscillation(last) == pytest.approx(0.025)
    alone = SimpleNamespace(phase="last", history=[record("first", 9.0), record("last", 4.0)])
    assert multistart._measure_oscillation(alone) == 0.0


def make_start(force, hysteresis=0.0, *, agreements=0, attempts=1, oscillation=0.0):
    """A start with this misfit [N] and law residual; the misfit changed by a share on its last mesh."""
    records = [TrainingRecord(0.0, "last", f, 0.0, 0.0) for f in (1.0, 1.0 + oscillation)]
    training = SimpleNamespace(phase="last", history=records)
    result = SimpleNamespace(misfit=Misfit(force, hysteresis, 0.0, 0.0))
    return multistart._BestStart(training, result, attempts, agreements)


@pytest.mark.parametrize(
    ("first", "second", "winner", "agreements"),
    [
        ({"force": 2.0, "agreements": 0}, {"force": 2.019}, "first", 1),  # within a hundredth
        ({"force": 2.0}, {"force": 1.981}, "second", 1),
        ({"force": 2.0}, {"force": 2.021}, "first", 0),
        ({"force": 2.0, "agreements": 3}, {"force": 2.5}, "first", 3),
        ({"force": 2.0, "agreements": 3}, {"force": 1.5}, "second", 0),
        ({"force": 2.0}, {"force": 2.3, "oscillation": 0.2}, "first", 1),  # the last mesh still changed more
        ({"force": 2.0, "oscillation": -0.1}, {"force": 2.3, "oscillation": 0.1}, "first", 1),
        ({"force": 2.0, "hysteresis": 0.04}, {"force": 2.3}, "second", 0),  # 2 + 0.4 against 2.3 times the noise
        ({"force": 2.0, "hysteresis": 0.02}, {"force": 2.3}, "first", 0),
    ],
)
def test_the_better_of_two_starts_counts_how_many_ended_in_its_minimum(first, second, winner, agreements):
    best, candidate = make_start(**first), make_start(**second, attempts=7)
    chosen = multistart._choose_better(SimpleNamespace(noise=1.0), best, candidate)
    assert chosen.result is (best if winner == "first" else candidate).result
    assert (chosen.agreements, chosen.attempts) == (agreements, 7)


@pytest.mark.parametrize(
    ("hysteresis", "unresolved", "satisfied"), [(0.019, 0.0, True), (0.021, 0.0, False), (0.024, 0.015, True)]
)
def test_the_law_is_satisfied_up_to_its_tolerance_and_what_the_basis_cannot_follow(
    hysteresis, unresolved, satisfied
):
    result = SimpleNamespace(misfit=Misfit(1.0, hysteresis, 0.0, unresolved))
    assert multistart._is_law_satisfied(result) == satisfied
    assert multistart._has_converged(SimpleNamespace(noise=1.0), result) == satisfied


def test_a_start_converges_only_near_the_noise():
    far = SimpleNamespace(misfit=Misfit(1.5, 0.0, 0.0, 0.0))
    assert not multistart._has_converged(SimpleNamespace(noise=1.0), far)


@pytest.mark.parametrize(("share", "count"), [(0.5, 400), (0.1, 200), (0.9, 720)])
def test_an_opening_is_a_share_of_the_fitted_samples_of_at_least_two_seconds(share, count):
    train = np.ones(1000)
    train[:200] = 0.0
    piece = SimpleNamespace(train=train, excitation=SimpleNamespace(rate=100.0))
    opening = multistart._mask_opening(piece, share)
    assert np.flatnonzero(opening).tolist() == list(range(200, 200 + count))


def test_a_piece_shorter_than_two_seconds_is_its_own_opening():
    piece = SimpleNamespace(train=np.ones(150), excitation=SimpleNamespace(rate=100.0))
    assert multistart._mask_opening(piece, 0.1).sum() == 150


@pytest.mark.parametrize(("length", "masked"), [(12.0, False), (11.9, True)])
def test_only_longer_data_have_an_opening(length, masked):
    pieces = [SimpleNamespace(train=np.ones(600), excitation=SimpleNamespace(rate=100.0)) for _ in range(2)]
    problem = SimpleNamespace(pieces=pieces, replace_training=lambda masks: [m.sum() for m in masks])
    opening = multistart._select_opening(problem, length)
    assert (opening is not problem) == masked
    if masked:
        assert opening == [595, 595]


def test_the_note_states_starts_misfit_and_law_residual():
    problem = SimpleNamespace(noise=2.0)
    text = multistart._describe_training(problem, make_start(2.09, 0.02))
    assert text.startswith(
        "first start; the network's force reaches the noise (1.045 of it), the law residual is 2 %"
    )
    text = multistart._describe_training(problem, make_start(3.0, 0.02, attempts=2, agreements=1))
    assert text.startswith("best of 2 starts, 1 more ended there too; the network's force stays at 1.5 times")
    assert "no other ended there" in multistart._describe_training(problem, make_start(3.0))

"""Dampers trained together: each ends where it would alone, and none waits for another's recording."""

from dataclasses import replace

import pytest
import torch
from made_up_problem import problem

from identification.pinn.global_runs import GlobalTraining, batch_size
from identification.pinn.levenberg import Levenberg, Normal, gram
from identification.pinn.settings import GlobalSettings
from identification.pinn.split import validation_masks
from identification.pinn.supervision import Stopped, Supervision
from identification.pinn.train import batches, train, train_batch

SMALL = GlobalSettings(width=6, samples=500, steps=10)
DAMPERS = (
    problem((0.0, 0.4), 0.5),
    problem((0.0, 0.3), 0.7, seed=4),
    problem((0.0, 0.2), 1.0, seed=8),
)
"""Recordings of different length, noise and drive."""


def softer(given):
    """The same strokes with a force of three fifths: another damper."""
    return replace(given, pieces=tuple(replace(p, force=0.6 * p.force) for p in given.pieces))


@pytest.fixture(scope="module")
def together():
    dampers = (DAMPERS[0], softer(DAMPERS[1]), DAMPERS[2])
    return dampers, train_batch(dampers, SMALL)


def test_the_equations_of_a_batch_are_those_of_each_damper_alone():
    trainings = [GlobalTraining(some, SMALL, Supervision()) for some in (DAMPERS, *([one] for one in DAMPERS))]
    normals = []
    for training in trainings:
        training.weights = training.network.begin(3, "cpu").repeat(len(training.dampers), 1)
        normals.append(training.loss.normal(training._batch(), training.weights, training.q, 4.0))
    for name, joined in zip(Normal._fields, normals[0], strict=True):
        for k, alone in enumerate(normals[1:]):
            own = getattr(alone, name)[0]
            assert torch.allclose(joined[k], own, rtol=1e-9, atol=1e-12 * float(own.abs().max())), name


def test_each_damper_of_a_batch_ends_where_it_would_alone(together):
    """A thousandth is rounding here: few samples, and steps that are taken or not."""
    for given, found in zip(*together, strict=True):
        alone = train(given, SMALL)
        assert tuple(found.coordinates) == pytest.approx(tuple(alone.coordinates), rel=1e-2)
        assert [m.force for m in found.history] == pytest.approx([m.force for m in alone.history], rel=1e-3)
        assert tuple(found.reconstruction) == pytest.approx(tuple(alone.reconstruction), rel=1e-2)
        assert found.reconstructed[0].shape == given.pieces[0].force.shape
        assert found.note == alone.note
        assert found.accepted == alone.accepted


def test_dampers_of_a_batch_are_different_and_each_comes_nearer_to_its_own_force(together):
    _, found = together
    assert len({one.coordinates for one in found}) == len(found)
    for one in found:
        assert one.history[-1].force < one.history[0].force


def test_a_step_of_several_least_squares_is_that_of_each_alone_however_often_they_try():
    random = torch.Generator().manual_seed(5)
    slopes = torch.randn(3, 40, 6, generator=random, dtype=torch.float64)
    rows = torch.randn(3, 40, generator=random, dtype=torch.float64)
    limits = torch.tensor(
        [10.0, 0.05, 0.0]
    )  # the first may go all the way, the second a little, the third nowhere

    def step(some):
        here, allowed = some.tolist(), limits[some]
        asked = []

        def moved(left, points):
            asked.append(len(left))
            mine = some[left]
            moves = torch.where(
                (points.norm(dim=1) < allowed[left])[:, None], points, torch.full_like(points, 9.0)
            )
            missed = rows[mine] + (slopes[mine] @ moves[..., None])[..., 0]
            return moves, (missed**2).sum(1)

        descent = Levenberg(rows, len(here))
        point = torch.zeros(len(here), 6, dtype=torch.float64)
        found = descent.step(Normal.of(slopes[some], rows[some]), point, torch.zeros_like(point), moved)
        return found, descent.damping, asked

    found, damping, asked = step(torch.arange(3))
    assert asked[0] == 3
    assert asked[-1] == 1, "who has moved is not asked again"
    assert len(asked) == 6
    assert found[0].norm() > found[1].norm() > 0.0
    assert not found[2].any()
    for k in range(3):
        alone, own, _ = step(torch.tensor([k]))
        assert torch.allclose(found[k], alone[0], rtol=1e-12)
        assert torch.allclose(damping[k], own[0])


def test_products_are_the_same_by_half_of_them_and_by_all():
    slopes = torch.randn(2, 30, 7, generator=torch.Generator().manual_seed(2), dtype=torch.float64)
    assert torch.allclose(gram(slopes), slopes.mT @ slopes, rtol=1e-12)


def test_an_unknown_that_is_left_alone_does_not_move():
    slopes = torch.randn(1, 30, 4, generator=torch.Generator().manual_seed(3), dtype=torch.float64)
    rows = torch.ones(1, 30, dtype=torch.float64)

    def moved(_left, points):
        return points, ((rows + (slopes @ points[..., None])[..., 0]) ** 2).sum(1)

    normal = Normal.of(slopes, rows).only(torch.tensor([1.0, 0.0, 1.0, 1.0]))
    point = torch.zeros(1, 4, dtype=torch.float64)
    found = Levenberg(rows, 1).step(normal, point, torch.zeros_like(point), moved)
    assert found[0, 1] == 0.0
    assert found[0, [0, 2, 3]].abs().min() > 0.0


def test_dampers_go_together_that_bring_as_many_samples_and_stretches():
    short, two = problem((0.0, 0.3), 0.2), problem((0.0, 0.4), 0.5, pieces=2)
    given, accelerated = (
        [DAMPERS[0], short, DAMPERS[1], two, DAMPERS[2]],
        SMALL.model_copy(update={"device": "cuda"}),
    )
    assert batches(given, accelerated) == [[0, 2, 4], [1], [3]]
    assert batches([DAMPERS[0]] * 20, accelerated) == [list(range(16)), [16, 17, 18, 19]]
    assert batches([DAMPERS[0]] * 3, SMALL) == [[0], [1], [2]], "a processor is full with one"
    assert batch_size(short, SMALL) == (380, 1)
    with pytest.raises(ValueError, match="different sizes"):
        GlobalTraining([DAMPERS[0], short], SMALL, Supervision())


def test_blocks_set_aside_leave_a_damper_in_its_batch():
    given = DAMPERS[0]
    aside = validation_masks(given.pieces, 0.2, 1)
    assert aside[0].any()
    assert batch_size(given.without(aside), SMALL) == batch_size(given, SMALL)


def test_a_batch_stops_when_asked_with_what_every_damper_has():
    said = []

    def stop() -> bool:
        return said.count("pinn, law weighed 3") == 2

    supervision = Supervision(progress=lambda what, error: said.append(what), stop=stop)
    found = train_batch(DAMPERS[:2], SMALL, supervision)
    assert [one.note.split(";")[0] for one in found] == ["stopped on request"] * 2
    assert not any(one.accepted for one in found)
    with pytest.raises(Stopped, match="on request"):
        train_batch(DAMPERS[:2], SMALL, Supervision(stop=lambda: True))

"""Batches of dampers: each damper ends where it would alone, and recordings may differ in length."""

from dataclasses import replace

import pytest
import torch

from identification.pinn.common.settings import DenseSettings
from identification.pinn.common.training_monitor import TrainingMonitor, TrainingStopped
from identification.pinn.common.validation_split import make_validation_masks
from identification.pinn.dense.levenberg_marquardt import LevenbergMarquardt, NormalEquations, compute_gram
from identification.pinn.dense.training import DenseTraining, compute_batch_size
from identification.pinn.training import group_batches, train, train_batch
from tests.support.pinn_problem import make_problem

SMALL = DenseSettings(width=6, samples=500, steps=10)
DAMPERS = (
    make_problem((0.0, 0.4), 0.5),
    make_problem((0.0, 0.3), 0.7, seed=4),
    make_problem((0.0, 0.2), 1.0, seed=8),
)
"""Recordings of different length, noise and drive."""


def soften(problem):
    """Return the same strokes with three fifths of the force, as of another damper."""
    return replace(problem, pieces=tuple(replace(p, force=0.6 * p.force) for p in problem.pieces))


@pytest.fixture(scope="module")
def batch():
    dampers = (DAMPERS[0], soften(DAMPERS[1]), DAMPERS[2])
    return dampers, train_batch(dampers, SMALL)


def test_the_equations_of_a_batch_are_those_of_each_damper_alone():
    batches = (DAMPERS, *([damper] for damper in DAMPERS))
    trainings = [DenseTraining(dampers, SMALL, TrainingMonitor()) for dampers in batches]
    normals = []
    for training in trainings:
        training.weights = training.network.initialise_weights(3, "cpu").repeat(len(training.dampers), 1)
        normals.append(
            training.loss.assemble_normal_equations(training._draw_batch(), training.weights, training.q, 4.0)
        )
    for name, joined in zip(NormalEquations._fields, normals[0], strict=True):
        for k, alone in enumerate(normals[1:]):
            expected = getattr(alone, name)[0]
            assert torch.allclose(joined[k], expected, rtol=1e-9, atol=1e-12 * float(expected.abs().max())), name


def test_each_damper_of_a_batch_ends_where_it_would_alone(batch):
    """Rounding errors grow to a thousandth, because there are few samples and steps can be rejected."""
    for problem, result in zip(*batch, strict=True):
        alone = train(problem, SMALL)
        assert tuple(result.coordinates) == pytest.approx(tuple(alone.coordinates), rel=1e-2)
        assert [r.force for r in result.history] == pytest.approx([r.force for r in alone.history], rel=1e-3)
        assert tuple(result.reconstruction) == pytest.approx(tuple(alone.reconstruction), rel=1e-2)
        assert result.reconstructed_force[0].shape == problem.pieces[0].force.shape
        assert result.note == alone.note
        assert result.accepted == alone.accepted


def test_dampers_of_a_batch_are_different_and_the_misfit_of_each_decreases(batch):
    _, results = batch
    assert len({result.coordinates for result in results}) == len(results)
    for result in results:
        assert result.history[-1].force < result.history[0].force


def test_a_step_of_several_problems_is_that_of_each_alone_for_any_number_of_tries():
    random = torch.Generator().manual_seed(5)
    jacobian = torch.randn(3, 40, 6, generator=random, dtype=torch.float64)
    residuals = torch.randn(3, 40, generator=random, dtype=torch.float64)
    # The first problem accepts any step, the second a short one, the third none.
    limits = torch.tensor([10.0, 0.05, 0.0])

    def step(problems):
        count, allowed = len(problems), limits[problems]
        batch_sizes = []

        def evaluate(pending, points):
            batch_sizes.append(len(pending))
            rows = problems[pending]
            is_short = (points.norm(dim=1) < allowed[pending])[:, None]
            bounded = torch.where(is_short, points, torch.full_like(points, 9.0))
            errors = residuals[rows] + (jacobian[rows] @ bounded[..., None])[..., 0]
            return bounded, (errors**2).sum(1)

        solver = LevenbergMarquardt(residuals, count)
        point = torch.zeros(count, 6, dtype=torch.float64)
        normal = NormalEquations.assemble(jacobian[problems], residuals[problems])
        solution = solver.step(normal, point, torch.zeros_like(point), evaluate)
        return solution, solver.damping, batch_sizes

    solution, damping, batch_sizes = step(torch.arange(3))
    assert batch_sizes[0] == 3
    assert batch_sizes[-1] == 1, "a problem with a lower cost is not tried again"
    assert len(batch_sizes) == 6
    assert solution[0].norm() > solution[1].norm() > 0.0
    assert not solution[2].any()
    for k in range(3):
        alone, damping_alone, _ = step(torch.tensor([k]))
        assert torch.allclose(solution[k], alone[0], rtol=1e-12)
        assert torch.allclose(damping[k], damping_alone[0])


def test_the_gram_matrix_is_the_product_of_all_columns():
    jacobian = torch.randn(2, 30, 7, generator=torch.Generator().manual_seed(2), dtype=torch.float64)
    assert torch.allclose(compute_gram(jacobian), jacobian.mT @ jacobian, rtol=1e-12)


def test_a_fixed_unknown_does_not_move():
    jacobian = torch.randn(1, 30, 4, generator=torch.Generator().manual_seed(3), dtype=torch.float64)
    residuals = torch.ones(1, 30, dtype=torch.float64)

    def evaluate(_pending, points):
        return points, ((residuals + (jacobian @ points[..., None])[..., 0]) ** 2).sum(1)

    normal = NormalEquations.assemble(jacobian, residuals).restrict(torch.tensor([1.0, 0.0, 1.0, 1.0]))
    point = torch.zeros(1, 4, dtype=torch.float64)
    solution = LevenbergMarquardt(residuals, 1).step(normal, point, torch.zeros_like(point), evaluate)
    assert solution[0, 1] == 0.0
    assert solution[0, [0, 2, 3]].abs().min() > 0.0


def test_a_batch_has_dampers_with_the_same_numbers_of_samples_and_stretches():
    short, two_pieces = make_problem((0.0, 0.3), 0.2), make_problem((0.0, 0.4), 0.5, pieces=2)
    problems = [DAMPERS[0], short, DAMPERS[1], two_pieces, DAMPERS[2]]
    accelerated = SMALL.model_copy(update={"device": "cuda"})
    assert group_batches(problems, accelerated) == [[0, 2, 4], [1], [3]]
    assert group_batches([DAMPERS[0]] * 20, accelerated) == [list(range(16)), [16, 17, 18, 19]]
    assert group_batches([DAMPERS[0]] * 3, SMALL) == [[0], [1], [2]], "on a processor each damper is a batch"
    assert compute_batch_size(short, SMALL) == (380, 1)
    with pytest.raises(ValueError, match="different sizes"):
        DenseTraining([DAMPERS[0], short], SMALL, TrainingMonitor())


def test_validation_blocks_do_not_change_the_batch_of_a_damper():
    problem = DAMPERS[0]
    masks = make_validation_masks(problem.pieces, 0.2, 1)
    assert masks[0].any()
    assert compute_batch_size(problem.exclude_samples(masks), SMALL) == compute_batch_size(problem, SMALL)


def test_a_stopped_batch_returns_the_present_result_of_every_damper():
    messages = []

    def should_stop() -> bool:
        return messages.count("pinn, law weight 3") == 2

    monitor = TrainingMonitor(progress=lambda message, error: messages.append(message), should_stop=should_stop)
    results = train_batch(DAMPERS[:2], SMALL, monitor)
    assert [result.note.split(";")[0] for result in results] == ["stopped on request"] * 2
    assert not any(result.accepted for result in results)
    with pytest.raises(TrainingStopped, match="on request"):
        train_batch(DAMPERS[:2], SMALL, TrainingMonitor(should_stop=lambda: True))

"""Training of the dense network: one network for all half strokes, all layers trained by Gauss-Newton.

Levenberg-Marquardt moves weights and coordinates together. The law weight increases. Inputs that follow the
network's own slip are computed again in intervals, until three fifths of the steps are done. Filters of the force
channel count as a delay, and the residual delays are zero.

Several dampers take the same steps together, because the matrix products of one damper are too small for an
accelerator. Each has its own network, coordinates, samples and damping. A damper alone is a batch of one.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np
import torch
from torch import Tensor

from identification.arrays import Array
from identification.damper import Coordinates
from identification.fitting import COMMON_COUNT, COORDINATE_COUNT, Problem
from identification.pinn.common import (
    Y_UNIT,
    DenseSettings,
    TrainingMonitor,
    TrainingOutcome,
    TrainingRecord,
    TrainingStopped,
    approximate_filters,
    reconstruct_force,
)
from identification.pinn.dense.damper_batch import TrainingDamper
from identification.pinn.dense.inputs import NetworkInputs
from identification.pinn.dense.levenberg_marquardt import LevenbergMarquardt, NormalEquations
from identification.pinn.dense.loss import DenseLoss, Samples
from identification.pinn.dense.mlp import Perceptron

_PRETRAINING_STEPS, _REFRESH_INTERVAL = 25, 6
"""Steps on the initial states; steps between two computations of inputs and batch."""
_WEIGHT_RAMP, _RELEASE_SHARES, _FIXED_SHARE = (0.2, 0.6), (0.12, 0.3), 0.6
"""Shares of the steps [1]: ramp of the law weight; release of the coordinates; end of new inputs and batches.

The coordinates of the loop's shape are released last. If released earlier, while the force misfit is still large,
they diverge and do not return.
"""
_REFIT_SHARE = 0.75
"""Share of the steps [1] after which the validation blocks are fitted as well."""
_LATE_COORDINATES = ("rho", "n", "c1_b")
"""Coordinates that are released last."""
_LARGEST_STEP = 0.4
"""Largest change of a search coordinate in one step [1]."""
_COORDINATE_DAMPING, _DAMPING_SHARE = (1e-3, 1e-5), 0.5
"""Damping of the coordinates per sample [1], at first and later; share of the steps at which it changes."""
_CONVERGED_RATIO = 1.03
"""Threshold on the force misfit over the noise [1]: up to it, the training counts as converged."""


class DenseTraining:
    """Training of one network for each damper of a batch.

    Raises:
        ValueError: the dampers have different numbers of samples or of stretches.
    """

    def __init__(self, problems: Sequence[Problem], settings: DenseSettings, monitor: TrainingMonitor) -> None:
        self.settings, self.monitor = settings, monitor
        self.dampers = [TrainingDamper(problem, settings.seed, settings.features) for problem in problems]
        sizes = {compute_batch_size(d.problem, settings) for d in self.dampers}
        if len(sizes) > 1:
            raise ValueError(f"dampers of different sizes {sorted(sizes)} in one batch")
        self.samples = min(settings.samples, *(d.size[0] for d in self.dampers))
        self.network = Perceptron([self.dampers[0].size[1], *[settings.width] * settings.layers, 2])
        self.weights = self.network.initialise_weights(settings.seed, settings.device).repeat(len(problems), 1)
        self.solver, self.steps_done = LevenbergMarquardt(self.weights, len(problems)), 0
        self.history: list[list[TrainingRecord]] = [[] for _ in problems]
        self._pretrain()

    @property
    def loss(self) -> DenseLoss:
        """Loss of the samples that may be fitted at present."""
        return DenseLoss([d.recording for d in self.dampers], self.network)

    @property
    def q(self) -> Array:
        """Search coordinates (B, 13)."""
        return np.array([d.q for d in self.dampers])

    def run(self, last: float) -> None:
        """Take steps up to a share of all of them."""
        steps = self.settings.steps
        samples = self._draw_batch()
        while self.steps_done < round(last * steps):
            share = self.steps_done / steps
            if self.steps_done % _REFRESH_INTERVAL == 0 and share < _FIXED_SHARE:
                self._refresh()
                samples = self._draw_batch()
            self._take_step(
                samples,
                self._compute_law_weight(share),
                self._select_free(share),
                _COORDINATE_DAMPING[share >= _DAMPING_SHARE],
            )
            self.steps_done += 1

    def include_validation(self, problems: Sequence[Problem]) -> None:
        """Fit the validation blocks as well from now on."""
        for damper, problem in zip(self.dampers, problems, strict=True):
            damper.replace_problem(problem)

    def _compute_law_weight(self, done: float) -> float:
        first, last = self.settings.law_weights
        share = min(max((done - _WEIGHT_RAMP[0]) / (_WEIGHT_RAMP[1] - _WEIGHT_RAMP[0]), 0.0), 1.0)
        return first * float((last / first) ** share)

    def _select_free(self, done: float) -> Array:
        """Return a mask (B, 13) that is 1.0 where a coordinate may move."""
        late = np.array([name in _LATE_COORDINATES for name in Coordinates._fields])
        free = np.array([d.problem.space.free_mask for d in self.dampers])
        return np.asarray((free & ~(late & (done < _RELEASE_SHARES[1]))) * float(done >= _RELEASE_SHARES[0]))

    def _refresh(self) -> None:
        """Compute the inputs again for the present slips of the networks."""
        for number, damper in enumerate(self.dampers):
            damper.refresh(self._compute_inner_velocity(number, damper.inputs))

    def _compute_inner_velocity(self, damper: int, inputs: NetworkInputs) -> Array:
        """Return y' (N,) [m/s] of a damper's network at these inputs."""
        _, rate, _ = self.network.forward(self.weights[damper], *map(self._to_tensor, inputs))
        return np.asarray(rate[:, 1].cpu().numpy() * Y_UNIT)

    def evaluate_inner_velocity(self, damper: int, piece: int, time: Array) -> Array:
        """Return y' [m/s] of a damper at times [s] of one of its pieces."""
        inputs, rows = self.dampers[damper].compute_inputs(piece, time)
        return self._compute_inner_velocity(damper, inputs)[rows]

    def _pretrain(self) -> None:
        """Fit the weights to the initial states, with fixed coordinates."""
        # From random weights, free coordinates would follow the network's errors far from the damper.
        value, rate, target = self._gather_initial_states()

        def compute_residuals(weights: Tensor, dampers: Tensor) -> Tensor:
            outputs = self.network.forward(weights, value[dampers], rate[dampers])[0]
            return (outputs - target[dampers]).mT.flatten(1)

        def evaluate(dampers: Tensor, weights: Tensor) -> tuple[Tensor, Tensor]:
            return weights, (compute_residuals(weights, dampers) ** 2).sum(1)

        for k in range(_PRETRAINING_STEPS):
            jacobian = self._compute_state_jacobian(value, rate)
            residuals = compute_residuals(self.weights, torch.arange(len(target)))
            normal = NormalEquations.assemble(jacobian, residuals)
            self.weights = self.solver.step(normal, self.weights, torch.zeros_like(self.weights), evaluate)
            self.monitor.report(f"pinn, initial states {k + 1}", float("nan"))

    def _gather_initial_states(self) -> tuple[Tensor, Tensor, Tensor]:
        """Return inputs, their rates, and initial states at evenly spaced samples of each damper."""
        samples = [np.linspace(0, d.size[0] - 1, self.samples).astype(np.int64) for d in self.dampers]
        inputs, states = zip(
            *(d.compute_initial_states(k) for d, k in zip(self.dampers, samples, strict=True)), strict=True
        )
        value, rate = (self._to_tensor(np.stack(part)) for part in zip(*inputs, strict=True))
        return value, rate, self._to_tensor(np.stack(states))

    def _compute_state_jacobian(self, value: Tensor, rate: Tensor) -> Tensor:
        """Return the derivatives (B, 2 N, W) of z, then of y, over the weights."""
        _, _, cache = self.network.forward(self.weights, value, rate)
        dampers, samples, _ = value.shape
        jacobian = value.new_empty(dampers, 2 * samples, self.network.weight_count)
        for k in range(2):
            over_outputs = value.new_zeros(dampers, samples, 2)
            over_outputs[..., k] = 1.0
            rows = jacobian[:, k * samples : (k + 1) * samples]
            self.network.write_jacobian(self.weights, cache, over_outputs, torch.zeros_like(over_outputs), rows)
        return jacobian

    def _take_step(self, samples: Samples, law_weight: float, free: Array, damping: float) -> None:
        count, loss, q_before = self.network.weight_count, self.loss, self.q
        low, high = (np.array(bound) for bound in zip(*(d.bounds for d in self.dampers), strict=True))

        def evaluate(dampers: Tensor, points: Tensor) -> tuple[Tensor, Tensor]:
            k, weights = dampers.tolist(), points[:, :count]
            step = np.clip(points[:, count:].cpu().numpy() - q_before[k], -_LARGEST_STEP, _LARGEST_STEP)
            q = np.clip(q_before[k] + step, low[k], high[k])
            residuals = loss.select(k).compute_weighted_residuals(samples.select(k), weights, q, law_weight)
            return torch.cat([weights, self._to_tensor(q)], 1), (residuals**2).sum(1)

        movable = torch.cat([torch.ones_like(self.weights), self._to_tensor(free)], 1)
        normal = loss.assemble_normal_equations(samples, self.weights, q_before, law_weight).restrict(movable)
        point = torch.cat([self.weights, self._to_tensor(q_before)], 1)
        extra_damping = torch.zeros_like(point)
        extra_damping[:, count:] = damping * self.samples
        solution = self.solver.step(normal, point, extra_damping, evaluate)
        self.weights = solution[:, :count]
        for damper, q in zip(self.dampers, solution[:, count:].cpu().numpy(), strict=True):
            damper.q = q
        self._record_progress(samples, law_weight)

    def _draw_batch(self) -> Samples:
        """Draw samples of every damper."""
        drawn = zip(*(d.draw_samples(self.samples) for d in self.dampers), strict=True)
        piece, time, *columns = (np.stack(part) for part in drawn)
        return Samples(piece.astype(np.int64), time, *map(self._to_tensor, columns))

    def _record_progress(self, samples: Samples, law_weight: float) -> None:
        """Record the state of each damper, and report the largest misfit of the batch."""
        misfits, phase = self.loss.compute_misfits(samples, self.weights, self.q), f"law weight {law_weight:.3g}"
        for history, row in zip(self.history, misfits.tolist(), strict=True):
            history.append(TrainingRecord(self.monitor.seconds, phase, *row))
        self.monitor.report(f"pinn, {phase}", float(misfits[:, 0].max()))

    def make_outcomes(self, interruption: str) -> list[TrainingOutcome]:
        """Return the present outcome of each damper.

        Args:
            interruption: reason of an early end, as the begin of a note; empty at the regular end.
        """
        loss, samples = self.loss, self._draw_batch()
        covariances = loss.compute_covariance(samples, self.weights, self.q, self.settings.law_weights[1])
        return [self._make_outcome(k, covariance, interruption) for k, covariance in enumerate(covariances)]

    def _make_outcome(self, number: int, coordinate_covariance: Array, interruption: str) -> TrainingOutcome:
        damper, record = self.dampers[number], self.history[number][-1]
        unknowns = np.concatenate([damper.q, np.zeros(COMMON_COUNT - COORDINATE_COUNT)])
        velocity = partial(self.evaluate_inner_velocity, number)
        forces = tuple(
            reconstruct_force(p, i, velocity, unknowns, damper.problem) for i, p in enumerate(damper.pieces)
        )
        covariance = np.zeros((COMMON_COUNT, COMMON_COUNT))  # the delays are not fitted
        covariance[:COORDINATE_COUNT, :COORDINATE_COUNT] = coordinate_covariance
        ratio = record.force / damper.problem.noise
        accepted = not interruption and ratio <= _CONVERGED_RATIO
        note = f"{interruption}all layers trained; the network's force stays at {ratio:.3g} times the noise"
        return TrainingOutcome(
            unknowns, covariance, forces, accepted, note, self.steps_done, tuple(self.history[number])
        )

    def _to_tensor(self, values: Array) -> Tensor:
        return torch.as_tensor(values, device=self.settings.device)


def compute_batch_size(problem: Problem, settings: DenseSettings) -> tuple[int, int]:
    """Return samples per step and stretches of a damper; dampers with the same numbers can be trained together."""
    spans = [np.flatnonzero(p.train)[[0, -1]] for p in problem.pieces]
    return min(settings.samples, sum(int(last - first) + 1 for first, last in spans)), len(problem.pieces)


def train_dense(
    problems: Sequence[Problem],
    validation: Sequence[Sequence[Array]],
    settings: DenseSettings,
    monitor: TrainingMonitor,
) -> list[tuple[TrainingOutcome, TrainingOutcome]]:
    """Return the outcomes of several dampers, at the end and before the validation blocks were fitted.

    Three quarters of the steps exclude the validation blocks; the others fit all samples.

    Args:
        problems: problem of each damper.
        validation: validation masks (N,) of each damper's pieces.
        settings: settings of the network.
        monitor: progress, stop requests and budget.
    """
    split = [
        approximate_filters(problem.exclude_samples(masks))
        for problem, masks in zip(problems, validation, strict=True)
    ]
    training = DenseTraining(split, settings, monitor)
    blind, interruption = None, ""
    try:
        training.run(_REFIT_SHARE if settings.refit_on_all else 1.0)
        blind = training.make_outcomes(interruption)
        if settings.refit_on_all:
            training.include_validation([approximate_filters(problem) for problem in problems])
            training.run(1.0)
    except TrainingStopped as stopped:
        if not all(training.history):
            raise
        interruption = f"{stopped}; "
    final = training.make_outcomes(interruption)
    return list(zip(final, blind or final, strict=True))

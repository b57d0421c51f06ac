"""The network of the paper, eqs. 10-21, as closely as correct mathematics allows.

N(x, x', v, t) -> [u, y, z], all three learned. Five losses (eqs. 16-20) are weighted by phi_data and phi_phys (eq.
21). Unknowns are thirteen parameters and x0. Adam is followed by L-BFGS. Differences from the print, with their
reasons:

- du/dt has the stable sign, and eq. 13's slip is x' - y' as in eqs. 3 and 18 (see ``damper/law.py``).
- d/dt of the outputs is the derivative along the solution, with (x', x'', dv/dt, 1). dv/dt is zero between drive
  steps. ``derivative: partial`` is the printed form, kept as a research option to show its effect.
- Inputs, outputs and residuals are of order one, so that the weights are comparable. Positive parameters are
  searched as logarithms.

The inputs contain no memory of the loop, so this network cannot follow a hysteresis well. It is included as the
paper's method, not as a recommendation.
"""

import itertools
from collections.abc import Sequence
from typing import NamedTuple, cast

import numpy as np
import torch
from torch import Tensor

from identification.arrays import Array
from identification.damper import Parameters, law, to_coordinates, to_parameters
from identification.fitting import Problem
from identification.logs import Stretch
from identification.pinn.common import (
    PaperSettings,
    TrainingMonitor,
    TrainingOutcome,
    TrainingRecord,
    TrainingStopped,
    approximate_filters,
    generate_starts,
    make_training_pieces,
)
from identification.pinn.dense import Perceptron

_POSITIVE = ("alpha_a", "beta", "gamma", "eta", "A", "c0_a", "c1_a", "n")
_ADAM_REPORT_INTERVAL, _LBFGS_REPORT_INTERVAL = 25, 10
"""Steps between two reports, of Adam and of L-BFGS."""
_MIN_DAMPING = 1.0
"""Lower bound of c0 + c1 [N s/m], for drives at which it would be negative."""


class _PaperSamples(NamedTuple):
    """Samples of all pieces, one piece after the other; all (N,) but the inputs."""

    inputs: Tensor
    """Inputs of the network (4, N)."""
    rates: Tensor
    """Rates of the inputs (4, N) along the solution, or of t alone [1/s]."""
    x: Tensor
    v: Tensor
    drive: Tensor
    force: Tensor
    fitted: Tensor

    def select(self, indices: Tensor) -> "_PaperSamples":
        """Return some of the samples."""
        return _PaperSamples(*(part[..., indices] for part in self))


class _Scales(NamedTuple):
    """Values of the quantities that are one in the network's units."""

    u: float
    y: float
    z: float
    velocity: float
    force: float
    rate: float


class PaperTraining:
    """Training of the network and of the parameters.

    Args:
        problem: problem to learn.
        validation: validation mask (N,) of each piece.
        settings: settings of the network.
        monitor: progress, stop requests and budget.
    """

    def __init__(
        self, problem: Problem, validation: Sequence[Array], settings: PaperSettings, monitor: TrainingMonitor
    ) -> None:
        self.problem, self.settings, self.monitor = approximate_filters(problem), settings, monitor
        self.pieces = make_training_pieces(self.problem)
        self.start_parameters = to_parameters(next(generate_starts(self.problem)).coordinates)
        self.data = self._gather_samples(validation)
        self.monitor_samples = self._select_evenly(settings.samples)
        self.scales = self._choose_scales()
        self.network = Perceptron([4, *[settings.width] * settings.layers, 3])
        self.weights = self.network.initialise_weights(settings.seed, settings.device).requires_grad_()
        self.search_coordinates = torch.zeros(
            len(Parameters._fields), dtype=torch.float64, device=settings.device
        ).requires_grad_()
        self.history: list[TrainingRecord] = []
        self.steps = 0

    def _choose_scales(self) -> _Scales:
        """Return scales from the data and the initial guess, with which all residuals are of the order of one."""
        saturated = self.start_parameters.A * to_coordinates(self.start_parameters).D_y
        velocity = float(torch.sqrt(torch.mean(self.data.v**2)))
        return _Scales(
            u=max(self.problem.space.highest_drive, 1e-9), y=float(self.data.x.abs().max()), z=saturated,
            velocity=velocity, force=float(self.data.force.std()), rate=self.start_parameters.eta,
        )  # fmt: skip

    def run(self) -> None:
        """Train by Adam on random batches, then by L-BFGS on one fixed batch."""
        s = self.settings
        random = torch.Generator().manual_seed(s.seed)
        adam = torch.optim.Adam([self.weights, self.search_coordinates], lr=s.learning_rate)
        schedule = torch.optim.lr_scheduler.CosineAnnealingLR(adam, max(s.adam_steps, 1))
        count = len(self.data.x)
        for self.steps in range(1, s.adam_steps + 1):
            batch = torch.randint(0, count, (min(s.samples, count),), generator=random)
            adam.zero_grad()
            self._compute_loss(self.data.select(batch)).backward()  # type: ignore[no-untyped-call]
            adam.step()
            schedule.step()
            if self.steps % _ADAM_REPORT_INTERVAL == 0:
                self._record_progress("Adam")
        self._refine()

    def _refine(self) -> None:
        if not self.settings.lbfgs_steps:
            return
        samples = self._select_evenly(4 * self.settings.samples)
        parameters = [self.weights, self.search_coordinates]
        lbfgs = torch.optim.LBFGS(
            parameters, max_iter=_LBFGS_REPORT_INTERVAL, history_size=50, line_search_fn="strong_wolfe"
        )

        def closure() -> Tensor:
            lbfgs.zero_grad()
            loss = self._compute_loss(samples)
            loss.backward()  # type: ignore[no-untyped-call]
            return loss

        for _ in range(0, self.settings.lbfgs_steps, _LBFGS_REPORT_INTERVAL):
            lbfgs.step(closure)  # type: ignore[no-untyped-call]
            self.steps += _LBFGS_REPORT_INTERVAL
            self._record_progress("L-BFGS")

    def _select_evenly(self, count: int) -> _PaperSamples:
        """Return this number of samples in even steps, or all if there are fewer."""
        total = len(self.data.x)
        return self.data.select(torch.linspace(0, total - 1, min(count, total)).long())

    def get_parameters(self) -> Parameters:
        """Return the present parameters."""
        return Parameters(*decode_parameters(self.start_parameters, self.search_coordinates).tolist())

    def _compute_states(self, d: _PaperSamples) -> tuple[Tensor, Tensor]:
        """Return [u, y, z] (3, n) and their rates."""
        scale = d.x.new_tensor([[self.scales.u], [self.scales.y], [self.scales.z]])
        value, rate = self.network.compute_outputs(self.weights, d.inputs, d.rates)
        return value * scale, rate * scale

    def _compute_equations(self, d: _PaperSamples) -> tuple[Tensor, Tensor]:
        """Return forces [N] by eqs. 1 and 2 (2, n), and scaled residuals of eqs. 8, 4 and 3 (3, n)."""
        decoded = decode_parameters(self.start_parameters, self.search_coordinates).unbind()
        # The law accepts tensors in place of numbers.
        s, p = self.scales, Parameters(*cast(list[float], decoded))
        (u, y, z), (u_rate, y_rate, z_rate) = self._compute_states(d)
        alpha, c0, c1 = (law.evaluate_coefficient(a, b, u) for a, b in _pair_coefficients(p))
        first = alpha * z + c0 * (d.v - y_rate) + p.k0 * (d.x - y) + p.k1 * (d.x - p.x0)
        second = law.compute_force(y_rate, d.x, c1, p.k1, p.x0)
        damping = torch.clamp(c0 + c1, min=_MIN_DAMPING)
        inner = law.compute_inner_velocity(d.x, d.v, y, z, alpha, c0, damping - c0, p.k0)
        hysteresis = law.compute_hysteresis_rate(d.v - y_rate, z, p.A, p.beta, p.gamma, p.n)
        residuals = (
            (u_rate - law.compute_field_rate(u, d.drive, p.eta)) / (s.rate * s.u),
            (y_rate - inner) / s.velocity,
            (z_rate - hysteresis) / (self.start_parameters.A * s.velocity),
        )
        return torch.stack((first, second)), torch.stack(residuals)

    def _compute_loss(self, d: _PaperSamples) -> Tensor:
        """Return the loss of eq. 21."""
        forces, residuals = self._compute_equations(d)
        misfits = (forces - d.force) * (d.fitted / self.scales.force)
        data, physics = misfits.square().sum() / d.fitted.sum(), residuals.square().mean(1).sum()
        return self.settings.phi_data * data + self.settings.phi_phys * physics

    def _record_progress(self, phase: str) -> None:
        d = self.monitor_samples
        error = float(
            torch.sqrt((((self._compute_mean_force(d) - d.force) * d.fitted) ** 2).sum() / d.fitted.sum())
        )
        self.history.append(TrainingRecord(self.monitor.seconds, phase, error, float("nan"), float("nan")))
        self.monitor.report(f"pinn, {phase}", error)

    def compute_force(self) -> Tensor:
        """Return the network's own force (N,) [N], the mean of eqs. 1 and 2."""
        return self._compute_mean_force(self.data)

    def _compute_mean_force(self, d: _PaperSamples) -> Tensor:
        with torch.no_grad():
            return self._compute_equations(d)[0].mean(0)

    def _gather_samples(self, validation: Sequence[Array]) -> _PaperSamples:
        tables = []
        for source, mask in zip(self.pieces, validation, strict=True):
            piece, inputs, time = source.piece, source.inputs, source.sample_times
            x, v = inputs.evaluate_motion(time)
            a, drive = inputs.evaluate_acceleration(time), inputs.evaluate_drive(time, piece.drive_delay)
            tables.append(np.stack([x, v, a, drive, time, piece.force, piece.train - mask]))
        x, v, a, drive, time, force, fitted = np.hstack(tables)
        scale = np.array([np.abs(x).max(), v.std(), max(np.abs(drive).max(), 1e-9), time.max() / 2.0])
        total = self.settings.derivative == "total"
        zero, one = np.zeros_like(x), np.ones_like(x)
        rates = np.stack([v, a, zero, one] if total else [zero, zero, zero, one]) / scale[:, None]
        values = np.stack([x, v, drive, time - time.max() / 2.0]) / scale[:, None]
        device = self.settings.device
        return _PaperSamples(
            *(torch.as_tensor(q, device=device) for q in (values, rates, x, v, drive, force, fitted))
        )


def decode_parameters(start: Parameters, search_coordinates: Tensor) -> Tensor:
    """Return thirteen parameters and x0 (14,) from search coordinates that are zero at the start."""
    centre = search_coordinates.new_tensor(start)
    positive = torch.tensor([name in _POSITIVE for name in Parameters._fields], device=search_coordinates.device)
    return torch.where(
        positive, centre * search_coordinates.exp(), (centre.abs() + 1e-12) * search_coordinates + centre
    )


def _pair_coefficients(p: Parameters) -> tuple[tuple[float, float], ...]:
    return (p.alpha_a, p.alpha_b), (p.c0_a, p.c0_b), (p.c1_a, p.c1_b)


def train_paper(
    problem: Problem,
    validation: Sequence[Array],
    settings: PaperSettings,
    monitor: TrainingMonitor,
    stretches: Sequence[Stretch] | None,
) -> tuple[TrainingOutcome, TrainingOutcome]:
    """Return the outcome of one training without the validation blocks, twice: as in the paper, no refit follows.

    Args:
        problem: problem to learn.
        validation: validation mask (N,) of each piece.
        settings: settings of the network.
        monitor: progress, stop requests and budget.
        stretches: not used.
    """
    training = PaperTraining(problem, validation, settings, monitor)
    interruption = ""
    try:
        training.run()
    except TrainingStopped as stopped:
        if not training.history:
            raise
        interruption = f"{stopped}; "
    point = to_coordinates(training.get_parameters())
    force = training.compute_force().cpu().numpy()
    edges = np.cumsum([0, *(len(p.force) for p in problem.pieces)])
    ratio = training.history[-1].force / problem.noise if training.history else float("nan")
    outcome = TrainingOutcome(
        unknowns=np.concatenate([problem.space.to_search(point), np.zeros(2)]),
        covariance=None,
        forces=tuple(force[a:b] for a, b in itertools.pairwise(edges)),
        accepted=False,
        note=f"{interruption}the paper's network, whose force stays at {ratio:.3g} times the noise; "
        "it yields no intervals",
        steps=training.steps,
        history=tuple(training.history),
    )
    return outcome, outcome

"""The network of the paper, eqs. 10-21, as closely as correct mathematics allows.

N(x, x', v, t) -> [u, y, z], all three learned; five losses (eqs. 16-20) weighed by phi_data and phi_phys (eq. 21);
thirteen parameters and x0; Adam, then L-BFGS. What differs from the print, and why:

- du/dt has the stable sign, and eq. 13's slip is x' - y' as in eqs. 3 and 18 (see ``damper/law.py``).
- d/dt of the outputs is the derivative along the trajectory, with (x', x'', dv/dt, 1); dv/dt is zero between steps
  of the drive. With ``derivative: partial`` it is the printed reading, kept to show what that does.
- Inputs, outputs and residuals are of order one, so that the weights mean something; positive parameters are
  searched as logarithms.

The inputs hold no memory of the loop, so this network cannot follow a hysteresis well; it is here as the paper's
method, not as a recommendation.
"""

import itertools
from collections.abc import Sequence
from typing import NamedTuple, cast

import numpy as np
import torch
from torch import Tensor

from identification.arrays import Array
from identification.damper import law
from identification.damper.coordinates import to_coordinates, to_parameters
from identification.damper.parameters import Parameters
from identification.pinn.batches import learned
from identification.pinn.beginning import starts
from identification.pinn.local import coarse
from identification.pinn.mlp import Network
from identification.pinn.result import Moment, Outcome
from identification.pinn.settings import PaperSettings
from identification.pinn.supervision import Stopped, Supervision
from identification.problem import Problem
from identification.recordings import Stretch

_POSITIVE = ("alpha_a", "beta", "gamma", "eta", "A", "c0_a", "c1_a", "n")
_TOLD, _TOLD_LATER = 25, 10
"""Steps between two reports, of Adam and of L-BFGS."""
_LEAST_C = 1.0
"""[N s/m] that c0 + c1 is kept above, where a drive would make it negative."""


class _Data(NamedTuple):
    """Samples of all pieces, one after the other; all (N,) but the inputs."""

    inputs: Tensor
    """(4, N)"""
    rates: Tensor
    """(4, N) along the trajectory, or those of t alone."""
    x: Tensor
    v: Tensor
    drive: Tensor
    force: Tensor
    fitted: Tensor

    def at(self, places: Tensor) -> "_Data":
        """Some of the samples."""
        return _Data(*(part[..., places] for part in self))


class _Scales(NamedTuple):
    """What one means."""

    u: float
    y: float
    z: float
    velocity: float
    force: float
    rate: float


class PaperTraining:
    """Network and parameters in training."""

    def __init__(
        self, problem: Problem, held: Sequence[Array], settings: PaperSettings, supervision: Supervision
    ) -> None:
        self.problem, self.settings, self.supervision = coarse(problem), settings, supervision
        self.pieces = learned(self.problem)
        self.begin = to_parameters(next(starts(self.problem)).coordinates)
        self.data = self._gathered(held)
        self.shown = self._spread(settings.samples)
        saturated = self.begin.A * to_coordinates(self.begin).D_y
        velocity = float(torch.sqrt(torch.mean(self.data.v**2)))
        self.scales = _Scales(
            u=max(problem.space.highest_drive, 1e-9), y=float(self.data.x.abs().max()), z=saturated,
            velocity=velocity, force=float(self.data.force.std()), rate=self.begin.eta,
        )  # fmt: skip
        self.network = Network([4, *[settings.width] * settings.layers, 3])
        self.weights = self.network.begin(settings.seed, settings.device).requires_grad_()
        self.raw = torch.zeros(
            len(Parameters._fields), dtype=torch.float64, device=settings.device
        ).requires_grad_()
        self.history: list[Moment] = []
        self.steps = 0

    def run(self) -> None:
        """Adam on batches, then L-BFGS on everything."""
        s = self.settings
        random = torch.Generator().manual_seed(s.seed)
        adam = torch.optim.Adam([self.weights, self.raw], lr=s.learning_rate)
        falling = torch.optim.lr_scheduler.CosineAnnealingLR(adam, max(s.adam_steps, 1))
        count = len(self.data.x)
        for self.steps in range(1, s.adam_steps + 1):
            at = torch.randint(0, count, (min(s.samples, count),), generator=random)
            adam.zero_grad()
            self._loss(self.data.at(at)).backward()  # type: ignore[no-untyped-call]
            adam.step()
            falling.step()
            if self.steps % _TOLD == 0:
                self._note("Adam")
        self._polish()

    def _polish(self) -> None:
        if not self.settings.lbfgs_steps:
            return
        every = self._spread(4 * self.settings.samples)
        rest = torch.optim.LBFGS(
            [self.weights, self.raw], max_iter=_TOLD_LATER, history_size=50, line_search_fn="strong_wolfe"
        )

        def closure() -> Tensor:
            rest.zero_grad()
            loss = self._loss(every)
            loss.backward()  # type: ignore[no-untyped-call]
            return loss

        for _ in range(0, self.settings.lbfgs_steps, _TOLD_LATER):
            rest.step(closure)  # type: ignore[no-untyped-call]
            self.steps += _TOLD_LATER
            self._note("L-BFGS")

    def _spread(self, most: int) -> _Data:
        """So many samples in even steps, or all."""
        count = len(self.data.x)
        return self.data.at(torch.linspace(0, count - 1, min(most, count)).long())

    def parameters(self) -> Parameters:
        """What has been found."""
        return Parameters(*searched(self.begin, self.raw).tolist())

    def _states(self, d: _Data) -> tuple[Tensor, Tensor]:
        """[u, y, z] (3, n) and their rates."""
        scale = d.x.new_tensor([[self.scales.u], [self.scales.y], [self.scales.z]])
        value, rate = self.network.outputs(self.weights, d.inputs, d.rates)
        return value * scale, rate * scale

    def _equations(self, d: _Data) -> tuple[Tensor, Tensor]:
        """Forces [N] by eqs. 1 and 2 (2, n), and what eqs. 8, 4 and 3 leave (3, n), of order one."""
        # The law takes tensors for numbers.
        s, p = self.scales, Parameters(*cast(list[float], searched(self.begin, self.raw).unbind()))
        (u, y, z), (u_rate, y_rate, z_rate) = self._states(d)
        alpha, c0, c1 = (law.at_field(a, b, u) for a, b in _pairs(p))
        first = alpha * z + c0 * (d.v - y_rate) + p.k0 * (d.x - y) + p.k1 * (d.x - p.x0)
        second = law.force(y_rate, d.x, c1, p.k1, p.x0)
        both = torch.clamp(c0 + c1, min=_LEAST_C)
        inner = law.inner_velocity(d.x, d.v, y, z, alpha, c0, both - c0, p.k0)
        hysteresis = law.hysteresis_rate(d.v - y_rate, z, p.A, p.beta, p.gamma, p.n)
        left = (
            (u_rate - law.field_rate(u, d.drive, p.eta)) / (s.rate * s.u),
            (y_rate - inner) / s.velocity,
            (z_rate - hysteresis) / (self.begin.A * s.velocity),
        )
        return torch.stack((first, second)), torch.stack(left)

    def _loss(self, d: _Data) -> Tensor:
        """Eq. 21."""
        forces, left = self._equations(d)
        misfits = (forces - d.force) * (d.fitted / self.scales.force)
        data, physics = misfits.square().sum() / d.fitted.sum(), left.square().mean(1).sum()
        return self.settings.phi_data * data + self.settings.phi_phys * physics

    def _note(self, phase: str) -> None:
        d = self.shown
        error = float(torch.sqrt((((self._force(d) - d.force) * d.fitted) ** 2).sum() / d.fitted.sum()))
        self.history.append(Moment(self.supervision.seconds, phase, error, float("nan"), float("nan")))
        self.supervision.step(f"pinn, {phase}", error)

    def force(self) -> Tensor:
        """The network's own force (N,): the mean of both branches."""
        return self._force(self.data)

    def _force(self, d: _Data) -> Tensor:
        with torch.no_grad():
            return self._equations(d)[0].mean(0)

    def _gathered(self, held: Sequence[Array]) -> _Data:
        tables = []
        for source, aside in zip(self.pieces, held, strict=True):
            piece, inputs = source.piece, source.inputs
            time: Array = np.asarray(np.arange(len(piece.force)) * inputs.h - piece.force_delay)
            x, v = inputs.motion(time)
            a = (inputs.motion(time + 0.5 * inputs.h)[1] - inputs.motion(time - 0.5 * inputs.h)[1]) / inputs.h
            drive = inputs.drive(time, piece.drive_delay)
            tables.append(np.stack([x, v, a, drive, time, piece.force, piece.train - aside]))
        x, v, a, drive, time, force, fitted = np.hstack(tables)
        scale = np.array([np.abs(x).max(), v.std(), max(np.abs(drive).max(), 1e-9), time.max() / 2.0])
        total = self.settings.derivative == "total"
        zero, one = np.zeros_like(x), np.ones_like(x)
        rates = np.stack([v, a, zero, one] if total else [zero, zero, zero, one]) / scale[:, None]
        values = np.stack([x, v, drive, time - time.max() / 2.0]) / scale[:, None]
        device = self.settings.device
        return _Data(*(torch.as_tensor(q, device=device) for q in (values, rates, x, v, drive, force, fitted)))


def searched(begin: Parameters, raw: Tensor) -> Tensor:
    """Thirteen parameters and x0 (14,) from the numbers that are searched; zeros are where the search begins."""
    start = raw.new_tensor(begin)
    positive = torch.tensor([name in _POSITIVE for name in Parameters._fields], device=raw.device)
    return torch.where(positive, start * raw.exp(), (start.abs() + 1e-12) * raw + start)


def _pairs(p: Parameters) -> tuple[tuple[float, float], ...]:
    return (p.alpha_a, p.alpha_b), (p.c0_a, p.c0_b), (p.c1_a, p.c1_b)


def train_paper(
    problem: Problem,
    held: Sequence[Array],
    settings: PaperSettings,
    supervision: Supervision,
    stretches: Sequence[Stretch] | None,
) -> tuple[Outcome, Outcome]:
    """One training on what is not set aside, as in the paper."""
    training = PaperTraining(problem, held, settings, supervision)
    said = ""
    try:
        training.run()
    except Stopped as stopped:
        if not training.history:
            raise
        said = f"{stopped}; "
    point = to_coordinates(training.parameters())
    force = training.force().cpu().numpy()
    edges = np.cumsum([0, *(len(p.force) for p in problem.pieces)])
    ratio = training.history[-1].force / problem.noise if training.history else float("nan")
    outcome = Outcome(
        unknowns=np.concatenate([problem.space.to_search(point), np.zeros(2)]),
        covariance=None,
        forces=tuple(force[a:b] for a, b in itertools.pairwise(edges)),
        accepted=False,
        note=f"{said}the paper's network, whose force stays at {ratio:.3g} times the noise; it gives no intervals",
        steps=training.steps,
        history=tuple(training.history),
    )
    return outcome, outcome

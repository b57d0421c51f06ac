"""Training of one ordinary network on all half strokes at once, every layer of it, by Gauss-Newton.

Levenberg-Marquardt on weights and coordinates together; the law's weight rises, and the inputs that follow the
network's own slip are refreshed until three fifths of the way. Filters of the force channel count as a delay, and
the channels' delays are taken as reported.

Several dampers go through the same steps together, each with a network, coordinates, samples and damping of its
own: the products of one are small change for an accelerator. Alone, a damper is a batch of one.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np
import torch
from torch import Tensor

from identification.arrays import Array
from identification.damper.coordinates import Coordinates
from identification.pinn.global_damper import DamperInTraining
from identification.pinn.global_inputs import Shown
from identification.pinn.global_loss import GlobalLoss, Samples
from identification.pinn.levenberg import Levenberg, Normal
from identification.pinn.local import coarse
from identification.pinn.mesh import Y_UNIT
from identification.pinn.mlp import Network
from identification.pinn.reconstruct import recorded_force
from identification.pinn.result import Moment, Outcome
from identification.pinn.settings import GlobalSettings
from identification.pinn.supervision import Stopped, Supervision
from identification.problem import COMMON_COUNT, COORDINATE_COUNT, Problem

_PRETRAINING, _REFRESH = 25, 6
"""Steps on the first states; steps between two refreshments of inputs and batch."""
_WEIGHED, _FREED, _FIXED = (0.2, 0.6), (0.12, 0.3), 0.6
"""[1] of the steps: while the law's weight rises; from where coordinates move, at first without the shape (sooner,
while the network's force is still far off, they run away for good); from where inputs and batch stand."""
_TAKEN_BACK = 0.75
"""[1] of the steps, after which the blocks set aside are fitted too."""
_LATE = ("rho", "n", "c1_b")
_LARGEST = 0.4
_HELD, _HELD_UNTIL = (1e-3, 1e-5), 0.5
"""[1] per sample: damping of the coordinates at first, and from this share of the steps on."""
_REACHED = 1.03
"""[1] force misfit over the noise up to which the training counts as arrived."""


class GlobalTraining:
    """Networks in training, one a damper.

    Raises:
        ValueError: the dampers bring different numbers of samples or of stretches.
    """

    def __init__(self, problems: Sequence[Problem], settings: GlobalSettings, supervision: Supervision) -> None:
        self.settings, self.supervision = settings, supervision
        self.dampers = [DamperInTraining(problem, settings.seed, settings.features) for problem in problems]
        sizes = {batch_size(d.problem, settings) for d in self.dampers}
        if len(sizes) > 1:
            raise ValueError(f"dampers of different sizes {sorted(sizes)} in one batch")
        self.samples = min(settings.samples, *(d.size[0] for d in self.dampers))
        self.network = Network([self.dampers[0].size[1], *[settings.width] * settings.layers, 2])
        self.weights = self.network.begin(settings.seed, settings.device).repeat(len(problems), 1)
        self.descent, self.done = Levenberg(self.weights, len(problems)), 0
        self.history: list[list[Moment]] = [[] for _ in problems]
        self._pretrain()

    @property
    def loss(self) -> GlobalLoss:
        """Of the samples that may be fitted now."""
        return GlobalLoss([d.recorded for d in self.dampers], self.network)

    @property
    def q(self) -> Array:
        """(B, 13) search numbers."""
        return np.array([d.q for d in self.dampers])

    def run(self, last: float) -> None:
        """Steps up to a share of them all."""
        steps = self.settings.steps
        samples = self._batch()
        while self.done < round(last * steps):
            share = self.done / steps
            if self.done % _REFRESH == 0 and share < _FIXED:
                self._refresh()
                samples = self._batch()
            self._step(samples, self._physics(share), self._free(share), _HELD[share >= _HELD_UNTIL])
            self.done += 1

    def take_back(self, problems: Sequence[Problem]) -> None:
        """Fit the blocks set aside too."""
        for damper, problem in zip(self.dampers, problems, strict=True):
            damper.take_back(problem)

    def _physics(self, done: float) -> float:
        first, last = self.settings.physics
        share = min(max((done - _WEIGHED[0]) / (_WEIGHED[1] - _WEIGHED[0]), 0.0), 1.0)
        return first * float((last / first) ** share)

    def _free(self, done: float) -> Array:
        """(B, 13) 1.0 where a coordinate moves."""
        late = np.array([name in _LATE for name in Coordinates._fields])
        seen = np.array([d.problem.space.free for d in self.dampers])
        return np.asarray((seen & ~(late & (done < _FREED[1]))) * float(done >= _FREED[0]))

    def _refresh(self) -> None:
        """Inputs for the slips as the networks have them now."""
        for number, damper in enumerate(self.dampers):
            damper.refresh(self._inner_velocity(number, damper.shown))

    def _inner_velocity(self, damper: int, shown: Shown) -> Array:
        """Y' (N,) [m/s] of a damper where its network is shown this."""
        _, rate, _ = self.network.forward(self.weights[damper], *map(self._tensor, shown))
        return np.asarray(rate[:, 1].cpu().numpy() * Y_UNIT)

    def inner_velocity(self, damper: int, piece: int, time: Array) -> Array:
        """Y' [m/s] of a damper at times [s] of one of its pieces."""
        shown, rows = self.dampers[damper].shown_at(piece, time)
        return self._inner_velocity(damper, shown)[rows]

    def _pretrain(self) -> None:
        """Towards the states that the recorded forces show; the coordinates wait."""
        at = [np.linspace(0, d.size[0] - 1, self.samples).astype(np.int64) for d in self.dampers]
        shown, states = zip(*(d.beginning(k) for d, k in zip(self.dampers, at, strict=True)), strict=True)
        value, rate = (self._tensor(np.stack(part)) for part in zip(*shown, strict=True))
        target = self._tensor(np.stack(states))

        def missed(weights: Tensor, some: Tensor) -> Tensor:
            outputs = self.network.forward(weights, value[some], rate[some])[0]
            return (outputs - target[some]).mT.flatten(1)

        def moved(some: Tensor, weights: Tensor) -> tuple[Tensor, Tensor]:
            return weights, (missed(weights, some) ** 2).sum(1)

        for k in range(_PRETRAINING):
            slopes = self._state_slopes(value, rate)
            normal = Normal.of(slopes, missed(self.weights, torch.arange(len(target))))
            self.weights = self.descent.step(normal, self.weights, torch.zeros_like(self.weights), moved)
            self.supervision.step(f"pinn, first states {k + 1}", float("nan"))

    def _state_slopes(self, value: Tensor, rate: Tensor) -> Tensor:
        """(B, 2 N, W) slopes of z, then of y, over the weights."""
        _, _, passed = self.network.forward(self.weights, value, rate)
        dampers, samples, _ = value.shape
        slopes = value.new_empty(dampers, 2 * samples, self.network.count)
        for k in range(2):
            side = value.new_zeros(dampers, samples, 2)
            side[..., k] = 1.0
            part = slopes[:, k * samples : (k + 1) * samples]
            self.network.jacobian(self.weights, passed, side, torch.zeros_like(side), part)
        return slopes

    def _step(self, samples: Samples, physics: float, free: Array, held: float) -> None:
        count, loss, begin = self.network.count, self.loss, self.q
        low, high = (np.array(bound) for bound in zip(*(d.bounds for d in self.dampers), strict=True))

        def moved(some: Tensor, points: Tensor) -> tuple[Tensor, Tensor]:
            at = some.tolist()
            step = np.clip(points[:, count:].cpu().numpy() - begin[at], -_LARGEST, _LARGEST)
            q = np.clip(begin[at] + step, low[at], high[at])
            rows = loss.of(at).rows(samples.of(at), points[:, :count], q, physics)
            return torch.cat([points[:, :count], self._tensor(q)], 1), (rows**2).sum(1)

        normal = loss.normal(samples, self.weights, begin, physics)
        normal = normal.only(torch.cat([torch.ones_like(self.weights), self._tensor(free)], 1))
        point = torch.cat([self.weights, self._tensor(begin)], 1)
        holding = torch.zeros_like(point)
        holding[:, count:] = held * self.samples
        found = self.descent.step(normal, point, holding, moved)
        self.weights = found[:, :count]
        for damper, q in zip(self.dampers, found[:, count:].cpu().numpy(), strict=True):
            damper.q = q
        self._note(samples, physics)

    def _batch(self) -> Samples:
        """Some samples of every damper."""
        drawn = zip(*(d.drawn(self.samples) for d in self.dampers), strict=True)
        piece, time, *columns = (np.stack(part) for part in drawn)
        return Samples(piece.astype(np.int64), time, *map(self._tensor, columns))

    def _note(self, samples: Samples, physics: float) -> None:
        """Keep where each stands; the batch is told of by its worst."""
        misfits, phase = self.loss.misfits(samples, self.weights, self.q), f"law weighed {physics:.3g}"
        for history, own in zip(self.history, misfits.tolist(), strict=True):
            history.append(Moment(self.supervision.seconds, phase, *own))
        self.supervision.step(f"pinn, {phase}", float(misfits[:, 0].max()))

    def outcomes(self, said: str) -> list[Outcome]:
        """Where the dampers stand."""
        loss, samples = self.loss, self._batch()
        spread = loss.covariance(samples, self.weights, self.q, self.settings.physics[1])
        return [self._outcome(k, own, said) for k, own in enumerate(spread)]

    def _outcome(self, number: int, spread: Array, said: str) -> Outcome:
        damper, found = self.dampers[number], self.history[number][-1]
        unknowns = np.concatenate([damper.q, np.zeros(COMMON_COUNT - COORDINATE_COUNT)])
        velocity = partial(self.inner_velocity, number)
        forces = tuple(
            recorded_force(p, i, velocity, unknowns, damper.problem) for i, p in enumerate(damper.pieces)
        )
        covariance = np.zeros((COMMON_COUNT, COMMON_COUNT))  # the delays are not fitted
        covariance[:COORDINATE_COUNT, :COORDINATE_COUNT] = spread
        ratio = found.force / damper.problem.noise
        accepted = not said and ratio <= _REACHED
        note = f"{said}all layers trained; the network's force stays at {ratio:.3g} times the noise"
        return Outcome(unknowns, covariance, forces, accepted, note, self.done, tuple(self.history[number]))

    def _tensor(self, values: Array) -> Tensor:
        return torch.as_tensor(values, device=self.settings.device)


def batch_size(problem: Problem, settings: GlobalSettings) -> tuple[int, int]:
    """Samples in a step and stretches of a damper: those with the same can be trained together."""
    spans = [np.flatnonzero(p.train)[[0, -1]] for p in problem.pieces]
    return min(settings.samples, sum(int(last - first) + 1 for first, last in spans)), len(problem.pieces)


def train_global(
    problems: Sequence[Problem],
    held: Sequence[Sequence[Array]],
    settings: GlobalSettings,
    supervision: Supervision,
) -> list[tuple[Outcome, Outcome]]:
    """One training of several dampers: three quarters on what is not set aside, the rest on everything."""
    split = [coarse(problem.without(aside)) for problem, aside in zip(problems, held, strict=True)]
    training = GlobalTraining(split, settings, supervision)
    blind, said = None, ""
    try:
        training.run(_TAKEN_BACK if settings.take_back else 1.0)
        blind = training.outcomes(said)
        if settings.take_back:
            training.take_back([coarse(problem) for problem in problems])
            training.run(1.0)
    except Stopped as stopped:
        if not all(training.history):
            raise
        said = f"{stopped}; "
    final = training.outcomes(said)
    return list(zip(final, blind or final, strict=True))

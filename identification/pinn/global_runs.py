"""Training of one ordinary network on all half strokes at once, every layer of it, by Gauss-Newton.

Levenberg-Marquardt on weights and coordinates together; the law's weight rises, and the inputs that follow the
network's own slip are refreshed until three fifths of the way. Filters of the force channel count as a delay, and
the channels' delays are taken as reported.
"""

import itertools
from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from identification.arrays import Array
from identification.damper.coordinates import Coordinates
from identification.pinn.batches import Learned, learned
from identification.pinn.beginning import FirstStates, starts
from identification.pinn.global_inputs import Shown, network_inputs
from identification.pinn.global_loss import GlobalLoss, Samples
from identification.pinn.levenberg import Levenberg
from identification.pinn.local import coarse
from identification.pinn.mesh import Y_UNIT, SlipVelocity, States
from identification.pinn.mlp import Network
from identification.pinn.reconstruct import recorded_force
from identification.pinn.result import Moment, Outcome
from identification.pinn.settings import GlobalSettings
from identification.pinn.supervision import Stopped, Supervision
from identification.problem import COORDINATE_COUNT, Problem
from identification.recordings import Stretch

_PRETRAINING, _REFRESH = 25, 6
"""Steps on the first states; steps between two refreshments of inputs and batch."""
_WEIGHED, _FREED, _FIXED = (0.2, 0.6), (0.12, 0.3), 0.6
"""[1] of the steps: while the law's weight rises; from where coordinates move, at first without the shape (sooner,
while the network's force is still far off, they run away for good); from where inputs and batch stand."""
_TAKEN_BACK = 0.75
"""[1] of the steps, after which the blocks set aside are fitted too."""
_LATE = ("rho", "n", "c1_b")
_LARGEST = 0.4
_DENSER = 4.0
"""[1] how much likelier a sample near a breakthrough or a step is taken."""
_FAST = 3.0
"""[1] of the median rate of the memory input: faster is near a breakthrough."""
_HELD, _HELD_UNTIL = (1e-3, 1e-5), 0.5
"""[1] per sample: damping of the coordinates at first, and from this share of the steps on."""
_NARROW = -4
"""Column of the memory input as wide as the breakthrough."""
_REACHED = 1.03
"""[1] force misfit over the noise up to which the training counts as arrived."""


class GlobalTraining:
    """The network in training."""

    def __init__(self, problem: Problem, settings: GlobalSettings, supervision: Supervision) -> None:
        self.problem, self.settings, self.supervision = problem, settings, supervision
        self.pieces = learned(problem)
        self.first = next(starts(problem)).coordinates
        self.q = problem.space.to_search(self.first)
        self.random = np.random.default_rng(settings.seed)
        self.history: list[Moment] = []
        self.descent, self.done = Levenberg(), 0
        self.times = [_sample_times(p) for p in self.pieces]
        states = [FirstStates(p, self.first) for p in self.pieces]
        self.slips = [s.slip_velocity() for s in states]
        raw = network_inputs(self.pieces, self.times, self.slips, self.first)
        self.centre, self.spread = raw.value.mean(0), np.maximum(raw.value.std(0), 1e-9)
        self.shown = self._scaled(raw)
        self.network = Network([raw.value.shape[1], settings.width, settings.width, 2])
        self.weights = self.network.begin(settings.seed, settings.device)
        self._pretrain([s.at(t) for s, t in zip(states, self.times, strict=True)])

    @property
    def loss(self) -> GlobalLoss:
        """Of the samples that may be fitted now."""
        return GlobalLoss(self.problem, self.pieces, self.network)

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

    def take_back(self, problem: Problem) -> None:
        """Fit the blocks set aside too."""
        self.problem = problem
        self.pieces = learned(problem)

    def _physics(self, done: float) -> float:
        first, last = self.settings.physics
        share = min(max((done - _WEIGHED[0]) / (_WEIGHED[1] - _WEIGHED[0]), 0.0), 1.0)
        return first * float((last / first) ** share)

    def _free(self, done: float) -> Array:
        """(13,) 1.0 where a coordinate moves."""
        late = np.array([name in _LATE for name in Coordinates._fields])
        free = self.problem.space.free & ~(late & (done < _FREED[1]))
        return np.asarray(free * float(done >= _FREED[0]))

    def _scaled(self, raw: Shown) -> Shown:
        return Shown((raw.value - self.centre) / self.spread, raw.rate / self.spread)

    def _refresh(self) -> None:
        """Inputs at all samples, for the slip as the network has it now."""
        rates = self._states(self.shown).y_rate
        edges = np.cumsum([0, *(len(t) for t in self.times)])
        self.slips = [
            _interpolated(t, p.inputs.motion(t)[1] - rates[a:b])
            for t, p, (a, b) in zip(self.times, self.pieces, itertools.pairwise(edges), strict=True)
        ]
        c = self.problem.space.to_coordinates(self.q)
        self.shown = self._scaled(network_inputs(self.pieces, self.times, self.slips, c))

    def _states(self, shown: Shown) -> States:
        value, rate, _ = self.network.forward(self.weights, self._tensor(shown.value), self._tensor(shown.rate))
        z, y = value.T.cpu().numpy()
        return States(z, y * Y_UNIT, rate[:, 1].cpu().numpy() * Y_UNIT)

    def inner_velocity(self, piece: int, time: Array) -> Array:
        """Y' [m/s] of a piece at times [s]."""
        times = [time if k == piece else self.times[k][:1] for k in range(len(self.pieces))]
        c = self.problem.space.to_coordinates(self.q)
        found = self._states(self._scaled(network_inputs(self.pieces, times, self.slips, c)))
        first = sum(len(t) for t in times[:piece])
        return found.y_rate[first : first + len(time)]

    def _pretrain(self, states: Sequence[States]) -> None:
        """Towards the states that the recorded force shows; the coordinates wait."""
        every = max(1, len(self.shown.value) // self.settings.samples)
        value, rate = (self._tensor(a[::every]) for a in self.shown)
        columns = [np.concatenate([s.z for s in states]), np.concatenate([s.y for s in states]) / Y_UNIT]
        target = self._tensor(np.column_stack(columns)[::every])

        def missed(weights: Tensor) -> Tensor:
            return (self.network.forward(weights, value, rate)[0] - target).T.reshape(-1)

        def moved(weights: Tensor) -> tuple[Tensor, float]:
            return weights, float((missed(weights) ** 2).sum())

        for k in range(_PRETRAINING):
            _, _, passed = self.network.forward(self.weights, value, rate)
            sides = [
                target.new_zeros(target.shape).index_fill(1, torch.tensor(i, device=target.device), 1.0)
                for i in (0, 1)
            ]
            J = torch.cat([self.network.jacobian(self.weights, passed, s, torch.zeros_like(s)) for s in sides])
            self.weights = self.descent.step(
                J, missed(self.weights), self.weights, torch.zeros_like(self.weights), moved
            )
            self.supervision.step(f"pinn, first states {k + 1}", float("nan"))

    def _step(self, samples: Samples, physics: float, free: Array, held: float) -> None:
        count, loss = self.network.count, self.loss
        rows, J = loss.linearised(samples, self.weights, self.q, physics)
        J[:, count:] *= self._tensor(free)
        low, high = (bound[:COORDINATE_COUNT] for bound in self.problem.bounds())

        def moved(point: Tensor) -> tuple[Tensor, float]:
            step = np.clip(point[count:].cpu().numpy() - self.q, -_LARGEST, _LARGEST)
            q = np.clip(self.q + step, low, high)
            cost = float((loss.rows(samples, point[:count], q, physics) ** 2).sum())
            return torch.cat([point[:count], self._tensor(q)]), cost

        holding = torch.zeros_like(J[0])
        holding[count:] = held * len(samples.x)
        found = self.descent.step(J, rows, torch.cat([self.weights, self._tensor(self.q)]), holding, moved)
        self.weights, self.q = found[:count], found[count:].cpu().numpy()
        self._note(samples, physics)

    def _batch(self) -> Samples:
        """Some samples, more of them where z runs; their weights undo that."""
        rate = np.abs(self.shown.rate[:, _NARROW])
        chance = 1.0 + _DENSER * (rate > _FAST * np.median(rate))
        chance /= chance.sum()
        size = min(self.settings.samples, len(chance))
        at = np.sort(self.random.choice(len(chance), size, replace=False, p=chance))
        undo = np.clip(1.0 / (chance[at] * len(chance)), 0.3, 2.0)
        motion = [p.inputs.motion(t) for p, t in zip(self.pieces, self.times, strict=True)]
        columns = [np.concatenate(values)[at] for values in zip(*motion, strict=True)]
        columns += [np.concatenate(a)[at] for a in zip(*(_recorded(p) for p in self.pieces), strict=True)]
        x, v, force, fitted = map(self._tensor, columns)
        numbers = np.repeat(np.arange(len(self.times), dtype=np.int64), [len(t) for t in self.times])
        shown = self._tensor(self.shown.value[at]), self._tensor(self.shown.rate[at])
        counts = self._tensor(np.sqrt(undo / undo.mean()))
        return Samples(*shown, x, v, force, fitted, counts, numbers[at], np.concatenate(self.times)[at])

    def _note(self, samples: Samples, physics: float) -> None:
        misfits = self.loss.misfits(samples, self.weights, self.q)
        self.history.append(Moment(self.supervision.seconds, f"law weighed {physics:.3g}", *misfits))
        self.supervision.step(f"pinn, {self.history[-1].phase}", misfits[0])

    def covariance(self) -> Array:
        """(15, 15) of search numbers; the delays are not fitted."""
        found = np.zeros((COORDINATE_COUNT + 2,) * 2)
        inner = self.loss.covariance(self._batch(), self.weights, self.q, self.settings.physics[1])
        found[:COORDINATE_COUNT, :COORDINATE_COUNT] = inner
        return found

    def _tensor(self, values: Array) -> Tensor:
        return torch.as_tensor(values, device=self.settings.device)


def _samples_of(source: Learned) -> Array:
    """Samples from the first to the last fitted one."""
    fitted = np.flatnonzero(source.piece.train)
    return np.arange(fitted[0], fitted[-1] + 1)


def _sample_times(source: Learned) -> Array:
    """Their times [s] on the displacement's clock."""
    return _samples_of(source) * source.inputs.h - source.piece.force_delay


def _recorded(source: Learned) -> tuple[Array, Array]:
    """Their force [N], and 1.0 where it is fitted."""
    at = _samples_of(source)
    return source.piece.force[at], source.piece.train[at]


def _interpolated(time: Array, values: Array) -> SlipVelocity:
    return lambda t: np.interp(t, time, values)


def train_global(
    problem: Problem,
    held: Sequence[Array],
    settings: GlobalSettings,
    supervision: Supervision,
    stretches: Sequence[Stretch] | None,
) -> tuple[Outcome, Outcome]:
    """One training: three quarters on what is not set aside, the rest on everything."""
    split = problem.without(held)
    training = GlobalTraining(coarse(split), settings, supervision)
    blind, said = None, ""
    try:
        training.run(_TAKEN_BACK if settings.take_back else 1.0)
        blind = _outcome(training, said)
        if settings.take_back:
            training.take_back(coarse(problem))
            training.run(1.0)
    except Stopped as stopped:
        if not training.history:
            raise
        said = f"{stopped}; "
    final = _outcome(training, said)
    return final, blind or final


def _outcome(training: GlobalTraining, said: str) -> Outcome:
    """Where a training stands."""
    problem = training.problem
    found = training.history[-1]
    unknowns = np.concatenate([training.q, np.zeros(2)])
    forces = tuple(
        recorded_force(p, i, training.inner_velocity, unknowns, training.problem)
        for i, p in enumerate(training.pieces)
    )
    ratio = found.force / problem.noise
    accepted = not said and ratio <= _REACHED
    note = f"{said}all layers trained; the network's force stays at {ratio:.3g} times the noise"
    return Outcome(unknowns, training.covariance(), forces, accepted, note, training.done, tuple(training.history))

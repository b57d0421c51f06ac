"""One damper in the training of the global network: what is recorded of it, and what its network is shown.

Nothing here trains. Every damper has its own times, inputs and chance, so that it is shown the same in a batch of
many as alone.
"""

import itertools
from collections.abc import Sequence

import numpy as np

from identification.arrays import Array
from identification.damper.coordinates import Coordinates
from identification.pinn.batches import Learned, learned
from identification.pinn.beginning import FirstStates, starts
from identification.pinn.global_inputs import Shown, network_inputs
from identification.pinn.global_loss import Recorded
from identification.pinn.mesh import Y_UNIT, Indices, SlipVelocity
from identification.pinn.settings import GROUPS, Group
from identification.problem import COORDINATE_COUNT, Problem

_DENSER = 4.0
"""[1] how much likelier a sample near a breakthrough or a step is taken."""
_FAST = 3.0
"""[1] of the median rate of the memory input: faster is near a breakthrough."""
_NARROW = -4
"""Column of the memory input as wide as the breakthrough."""


class DamperInTraining:
    """Recordings of a damper, its coordinates and inputs as they stand."""

    def __init__(self, problem: Problem, seed: int, features: Sequence[Group] = GROUPS) -> None:
        self.problem, self.features = problem, features
        self.pieces = learned(problem)
        self.random = np.random.default_rng(seed)
        self.times = [_sample_times(p) for p in self.pieces]
        first = next(starts(problem)).coordinates
        self.q = problem.space.to_search(first)
        self._states = [FirstStates(p, first) for p in self.pieces]
        self._slips = [s.slip_velocity() for s in self._states]
        raw = self._raw(self.times, first)
        self._centre, self._spread = raw.value.mean(0), np.maximum(raw.value.std(0), 1e-9)
        self.shown = self._scaled(raw)

    @property
    def recorded(self) -> Recorded:
        """What is learned of it now."""
        return Recorded(self.problem, self.pieces)

    @property
    def coordinates(self) -> Coordinates:
        """As they stand."""
        return self.problem.space.to_coordinates(self.q)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lowest and highest search numbers, (13,) each."""
        low, high = self.problem.bounds()
        return low[:COORDINATE_COUNT], high[:COORDINATE_COUNT]

    @property
    def size(self) -> tuple[int, int]:
        """Samples, and inputs of a network that learns it."""
        return len(self.shown.value), self.shown.value.shape[1]

    def take_back(self, problem: Problem) -> None:
        """Learn other samples of the same recordings."""
        self.problem = problem
        self.pieces = learned(problem)

    def beginning(self, at: Indices) -> tuple[Shown, Array]:
        """Inputs at samples (n,), and the states (n, 2) that the force shows there, in the network's units."""
        states = [s.at(t) for s, t in zip(self._states, self.times, strict=True)]
        z, y = (np.concatenate([s[k] for s in states]) for k in (0, 1))
        return Shown(*(part[at] for part in self.shown)), np.column_stack([z, y / Y_UNIT])[at]

    def refresh(self, y_rate: Array) -> None:
        """Inputs at all samples, for the y' (N,) [m/s] that the network has there now."""
        edges = np.cumsum([0, *(len(t) for t in self.times)])
        self._slips = [
            _interpolated(t, p.inputs.motion(t)[1] - y_rate[a:b])
            for t, p, (a, b) in zip(self.times, self.pieces, itertools.pairwise(edges), strict=True)
        ]
        self.shown = self._scaled(self._raw(self.times, self.coordinates))

    def shown_at(self, piece: int, time: Array) -> tuple[Shown, slice]:
        """Inputs at times [s] of one piece, and the rows in which they stand."""
        times = [time if k == piece else t[:1] for k, t in enumerate(self.times)]
        shown = self._scaled(self._raw(times, self.coordinates))
        return shown, slice(piece, piece + len(time))

    def drawn(self, size: int) -> tuple[Array, ...]:
        """So many samples, as ``Samples`` holds them: more where z runs, with weights that undo that."""
        chance = np.ones(len(self.shown.rate))
        if "memory" in self.features:
            rate = np.abs(self.shown.rate[:, _NARROW])
            chance += _DENSER * (rate > _FAST * np.median(rate))
        chance /= chance.sum()
        at = np.sort(self.random.choice(len(chance), size, replace=False, p=chance))
        undo = np.clip(1.0 / (chance[at] * len(chance)), 0.3, 2.0)
        motion = [p.inputs.motion(t) for p, t in zip(self.pieces, self.times, strict=True)]
        columns = [np.concatenate(values)[at] for values in zip(*motion, strict=True)]
        columns += [np.concatenate(values)[at] for values in zip(*map(_recorded, self.pieces), strict=True)]
        numbers = np.repeat(np.arange(len(self.times)), [len(t) for t in self.times])
        shown = (part[at] for part in self.shown)
        return numbers[at], np.concatenate(self.times)[at], *shown, *columns, np.sqrt(undo / undo.mean())

    def _raw(self, times: Sequence[Array], c: Coordinates) -> Shown:
        return network_inputs(self.pieces, times, self._slips, c, self.features)

    def _scaled(self, raw: Shown) -> Shown:
        return Shown((raw.value - self._centre) / self._spread, raw.rate / self._spread)


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

"""One damper in the training of the dense network: its recordings, coordinates and network inputs.

Every damper has its own sample times, inputs and random numbers, so that its samples in a batch are those of a
training alone.
"""

import itertools
from collections.abc import Sequence

import numpy as np

from identification.arrays import Array
from identification.damper import Coordinates
from identification.fitting import COORDINATE_COUNT, Problem
from identification.pinn.common import (
    FEATURE_GROUPS,
    Y_UNIT,
    FeatureGroup,
    Indices,
    InitialStates,
    SlipVelocity,
    TrainingPiece,
    generate_starts,
    make_training_pieces,
)
from identification.pinn.dense.inputs import NetworkInputs, compute_network_inputs
from identification.pinn.dense.loss import DamperRecording

_DENSITY_FACTOR = 4.0
"""Additional probability of a sample near a breakthrough or a step, over that of others [1]."""
_FAST_RATIO = 3.0
"""Threshold on the rate of the memory input over its median [1]: above it, a sample is near a breakthrough."""
_MEMORY_COLUMN = -4
"""Column of the memory input that is as wide as the breakthrough."""


class TrainingDamper:
    """Recordings of a damper, with its present coordinates and network inputs."""

    def __init__(self, problem: Problem, seed: int, features: Sequence[FeatureGroup] = FEATURE_GROUPS) -> None:
        self.problem, self.features = problem, features
        self.pieces = make_training_pieces(problem)
        self.random = np.random.default_rng(seed)
        self.times = [p.sample_times[_list_samples(p)] for p in self.pieces]
        start = next(generate_starts(problem)).coordinates
        self.q = problem.space.to_search(start)
        self._states = [InitialStates(p, start) for p in self.pieces]
        self._slips = [s.make_slip_velocity() for s in self._states]
        raw = self._compute_raw_inputs(self.times, start)
        self._centre, self._deviation = raw.value.mean(0), np.maximum(raw.value.std(0), 1e-9)
        self.inputs = self._normalise(raw)

    @property
    def recording(self) -> DamperRecording:
        """Problem and pieces that are learned at present."""
        return DamperRecording(self.problem, self.pieces)

    @property
    def coordinates(self) -> Coordinates:
        """Present coordinates."""
        return self.problem.space.to_coordinates(self.q)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the search coordinates, (13,) each."""
        low, high = self.problem.get_bounds()
        return low[:COORDINATE_COUNT], high[:COORDINATE_COUNT]

    @property
    def size(self) -> tuple[int, int]:
        """Number of samples, and number of network inputs."""
        return len(self.inputs.value), self.inputs.value.shape[1]

    def replace_problem(self, problem: Problem) -> None:
        """Learn other samples of the same recordings from now on."""
        self.problem = problem
        self.pieces = make_training_pieces(problem)

    def compute_initial_states(self, samples: Indices) -> tuple[NetworkInputs, Array]:
        """Return inputs and initial states (n, 2) at samples (n,), in the network's units."""
        states = [s.evaluate(t) for s, t in zip(self._states, self.times, strict=True)]
        z, y = (np.concatenate([s[k] for s in states]) for k in (0, 1))
        inputs = NetworkInputs(*(part[samples] for part in self.inputs))
        return inputs, np.column_stack([z, y / Y_UNIT])[samples]

    def refresh(self, y_rate: Array) -> None:
        """Compute the inputs at all samples again, for the network's present y' (N,) [m/s]."""
        edges = np.cumsum([0, *(len(t) for t in self.times)])
        self._slips = [
            _interpolate(t, p.inputs.evaluate_motion(t)[1] - y_rate[a:b])
            for t, p, (a, b) in zip(self.times, self.pieces, itertools.pairwise(edges), strict=True)
        ]
        self.inputs = self._normalise(self._compute_raw_inputs(self.times, self.coordinates))

    def compute_inputs(self, piece: int, time: Array) -> tuple[NetworkInputs, slice]:
        """Return inputs at times [s] of one piece, and the rows that hold them."""
        times = [time if k == piece else t[:1] for k, t in enumerate(self.times)]
        inputs = self._normalise(self._compute_raw_inputs(times, self.coordinates))
        return inputs, slice(piece, piece + len(time))

    def draw_samples(self, size: int) -> tuple[Array, ...]:
        """Draw samples as columns of ``Samples``: more of them at breakthroughs, with weights to compensate."""
        probability = np.ones(len(self.inputs.rate))
        if "memory" in self.features:
            rate = np.abs(self.inputs.rate[:, _MEMORY_COLUMN])
            probability += _DENSITY_FACTOR * (rate > _FAST_RATIO * np.median(rate))
        probability /= probability.sum()
        samples = np.sort(self.random.choice(len(probability), size, replace=False, p=probability))
        weights = np.clip(1.0 / (probability[samples] * len(probability)), 0.3, 2.0)
        motion = [p.inputs.evaluate_motion(t) for p, t in zip(self.pieces, self.times, strict=True)]
        columns = [np.concatenate(values)[samples] for values in zip(*motion, strict=True)]
        columns += [np.concatenate(values)[samples] for values in zip(*map(_read_force, self.pieces), strict=True)]
        numbers = np.repeat(np.arange(len(self.times)), [len(t) for t in self.times])
        inputs = (part[samples] for part in self.inputs)
        times = np.concatenate(self.times)[samples]
        return numbers[samples], times, *inputs, *columns, np.sqrt(weights / weights.mean())

    def _compute_raw_inputs(self, times: Sequence[Array], c: Coordinates) -> NetworkInputs:
        return compute_network_inputs(self.pieces, times, self._slips, c, self.features)

    def _normalise(self, raw: NetworkInputs) -> NetworkInputs:
        return NetworkInputs((raw.value - self._centre) / self._deviation, raw.rate / self._deviation)


def _list_samples(source: TrainingPiece) -> Array:
    """Return the samples from the first to the last fitted one."""
    fitted = np.flatnonzero(source.piece.train)
    return np.arange(fitted[0], fitted[-1] + 1)


def _read_force(source: TrainingPiece) -> tuple[Array, Array]:
    """Return the force [N] at these samples, and 1.0 where it is fitted."""
    samples = _list_samples(source)
    return source.piece.force[samples], source.piece.train[samples]


def _interpolate(time: Array, values: Array) -> SlipVelocity:
    return lambda t: np.interp(t, time, values)

"""The elements of a local network in batches, with everything that does not change while the mesh stands.

Elements of about equally many samples are handled together, in few operations on large arrays.

Behind a force channel with a filter it is y' that goes through the filter's impulse response, on the filter's own
fine grid and once for each mesh; field and displacement are taken where the filter's lag puts them, for they are
slow beside it. A filter remembers the element before: what that one adds is taken from the network as it stands.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from identification.arrays import Array
from identification.force_channel import LowPass
from identification.piece import Piece
from identification.pinn.inputs import Inputs
from identification.pinn.mesh import Element, Indices, LocalNetwork, Mesh, Span
from identification.pinn.quadrature import gauss_points, slopes_by_parts
from identification.pinn.settings import Residual
from identification.problem import Problem

_ALIKE = 1.35
"""[1] ratio of sample counts up to which elements share a batch."""
_LARGEST = 12_000
"""Points in a batch: its tensors stay below what the system's allocator gives back at once, page by page."""
_LOOSE = 0.1
"""[1] weight of the one test that the heads cannot meet beside all others."""
_TAIL = 1e-7
"""[1] of an impulse response that is left off."""


@dataclass(frozen=True)
class Learned:
    """One piece as the network sees it."""

    number: int
    """Its place in the problem."""
    piece: Piece
    inputs: Inputs
    span: Span
    thin: int
    """Every how many samples one is taken."""

    @cached_property
    def response(self) -> Array:
        """Impulse response of the force channel on its fine grid, newest first; a single 1 without a filter."""
        if self.piece.low_pass is None:
            return np.ones(1)
        reported, rate = self.piece.low_pass.reported, self.piece.low_pass.rate * self.finer
        impulse = np.zeros(round(rate))
        impulse[1] = 1.0
        found = LowPass(reported, rate).apply(impulse)[1:]
        kept = found[: int(np.flatnonzero(np.abs(found) > _TAIL)[-1]) + 1]
        return np.asarray(kept / kept.sum())

    @property
    def lag(self) -> float:
        """[s] by which the filter delays what is slow."""
        return float(self.response @ np.arange(len(self.response))) * self.inputs.h / self.finer

    @property
    def finer(self) -> int:
        """Points of the fine grid for each sample."""
        return self.piece.low_pass.finer if self.piece.low_pass else 1

    @property
    def step(self) -> int:
        """Points of the fine grid from one taken sample to the next."""
        return self.finer * self.thin


def learned(problem: Problem, *, thin: int = 1) -> list[Learned]:
    """The pieces of a problem, each from its first to its last fitted sample."""
    return [_learned(number, piece, thin) for number, piece in enumerate(problem.pieces)]


def _learned(number: int, piece: Piece, thin: int) -> Learned:
    inputs = Inputs(piece)
    at = np.flatnonzero(piece.train) * inputs.h - piece.force_delay
    span = Span(max(float(at[0]), 0.0), min(float(at[-1]), inputs.duration))
    return Learned(number, piece, inputs, span, thin)


@dataclass(frozen=True)
class Batch:
    """Some elements of one piece: K of them, M points for the law, S samples."""

    source: Learned
    elements: Indices
    """(K,) their numbers."""
    left: Indices
    """(K,) their left nodes."""
    time: Array
    """(K, M) [s] where the law is asked for."""
    values: Array
    """(M, rank) the functions at these points, the same in all elements."""
    slopes: Array
    """(K, M, rank) their slopes over time [1/s]."""
    tests: Array
    """(M, rank) orthonormal combinations of the functions' slopes and, last, of the functions; weighed by the
    quadrature."""
    asked: Array
    """(M, rank) the tests as they are asked, the last one lightly; (M, M) where each point is asked by itself."""
    share: Array
    """(K, M) root of the samples that each point stands for."""
    slip_velocity: Array
    """(K,) [m/s] that a violation of the hysteresis is measured by."""
    motion: tuple[Array, Array]
    """(K, M) displacement [m] and velocity [m/s], the latter as the residual is asked for."""
    samples: Indices
    """(K, S) their places in the recording."""
    sample_time: Array
    """(K, S) [s] of the motion that each recorded force belongs to."""
    sample_rate: Array
    """(K, S, rank) the functions' slopes over time [1/s], as the force channel passes them."""
    sample_change: Array
    """(K, S, rank) and the slopes of these [1/s²]."""
    before: Array
    """(K, S) what the filter remembers of the elements before, in y' [m/s]."""
    sample_motion: tuple[Array, Array]
    """(K, S) displacement [m] and velocity [m/s]."""
    force: Array
    """(K, S) recorded [N]."""
    counts: Array
    """(K, S) weight of each sample [1]; 0 where it is not fitted."""


def make_batches(
    pieces: Sequence[Learned], network: LocalNetwork, force_delay: float, points: int, residual: Residual = "means"
) -> list[Batch]:
    """All elements in batches.

    Args:
        pieces: what is learned.
        network: whose elements and hidden layer they are.
        force_delay: lag of the force channel beyond what it reports [s], as far as it is known.
        points: M.
        residual: how the law is asked for.
    """
    return [
        _batch(source, network, elements, force_delay, points, residual)
        for number, source in enumerate(pieces)
        for elements in _alike(source, network.mesh, network.mesh.of_piece(number))
    ]


def _alike(source: Learned, mesh: Mesh, mine: Indices) -> Iterator[Indices]:
    """Elements of about the same length, together."""
    lengths = np.array([mesh.elements[k].memory.length for k in mine]) / source.inputs.h + 4.0 * source.thin
    order = np.argsort(lengths)
    start = 0
    for stop in range(1, len(order) + 1):
        full = (
            stop < len(order) and (stop + 1 - start) * lengths[order[stop]] * source.finer > _LARGEST * source.thin
        )
        if stop == len(order) or full or lengths[order[stop]] > _ALIKE * lengths[order[start]]:
            yield np.sort(mine[order[start:stop]])
            start = stop


def _batch(
    source: Learned, network: LocalNetwork, numbers: Indices, force_delay: float, points: int, residual: Residual
) -> Batch:
    elements = [network.mesh.elements[k] for k in numbers]
    nodes, quadrature = gauss_points(points)
    time = np.stack([e.start + e.memory.time(nodes) for e in elements])
    rate = np.stack([e.memory.at(e.memory.time(nodes))[1] for e in elements])
    late = source.piece.force_delay + force_delay
    samples = _samples(source, elements, late)
    sample_time: Array = np.asarray(samples * source.inputs.h - late - source.lag)
    sample_rate, sample_change, before = _at_samples(source, network, elements, samples, late)
    inside = np.clip(samples, 0, len(source.piece.force) - 1)
    lengths = np.array([e.memory.length for e in elements]) / source.inputs.h
    values = network.layer.values(nodes)
    tests = _tests(values, network.layer.slopes(nodes), np.sqrt(quadrature)[:, None])
    motion = source.inputs.motion(time)
    if residual == "weak":
        motion = motion[0], rate * _rises(source, elements, points)
    return Batch(
        source=source,
        elements=numbers,
        left=network.mesh.lefts[numbers],
        time=time,
        values=values,
        slopes=network.layer.slopes(nodes) * rate[..., None],
        tests=tests,
        asked=np.eye(points) if residual == "points" else np.hstack([tests[:, :-1], _LOOSE * tests[:, -1:]]),
        share=np.sqrt(quadrature * np.maximum(lengths, 1.0)[:, None]),
        slip_velocity=np.array([e.slip_velocity for e in elements]),
        motion=motion,
        samples=inside,
        sample_time=sample_time,
        sample_rate=sample_rate,
        sample_change=sample_change,
        before=before,
        sample_motion=source.inputs.motion(sample_time),
        force=source.piece.force[inside],
        counts=_counts(source, elements, samples, late),
    )


def _tests(values: Array, slopes: Array, weight: Array) -> Array:
    """What the law's residual is weighed with in an element: a test for each of its own heads, and one more.

    Elements share a node, so that each has one head fewer than functions; the functions' slopes are as many, for
    the constant has none (Petrov and Galerkin). The last test keeps residuals from swinging between these.
    """
    met = np.linalg.svd(weight * slopes, full_matrices=False)[0][:, :-1]
    beyond = weight * values - met @ (met.T @ (weight * values))
    return np.hstack([met, np.linalg.svd(beyond, full_matrices=False)[0][:, :1]])


def _rises(source: Learned, elements: Sequence[Element], points: int) -> Array:
    """(K, M) slopes [m] of the displacement over the input, from the displacement alone."""
    places, table = slopes_by_parts(points)
    x, _ = source.inputs.motion(np.stack([e.start + e.memory.time(places) for e in elements]))
    return np.asarray(x @ table)


def _at_samples(
    source: Learned, network: LocalNetwork, elements: Sequence[Element], samples: Indices, late: float
) -> tuple[Array, Array, Array]:
    """Slopes of the functions at the samples, slopes of these, and what elements before add to y'."""
    taps = len(source.response)
    grid = samples * source.finer
    if taps > 1:
        grid = grid[:, :1] + np.arange(1 - taps, (samples.shape[1] - 1) * source.step + 1)
    time = grid * source.inputs.h / source.finer - late
    inside = np.stack([np.clip(t, e.start, e.end) for t, e in zip(time, elements, strict=True)])
    mapped = [e.memory.at(t - e.start) for t, e in zip(inside, elements, strict=True)]
    place, speed, bend = (np.stack(values) for values in zip(*mapped, strict=True))
    slopes, curvatures = network.layer.slopes_and_curvatures(place)
    change = curvatures * speed[..., None] ** 2 + slopes * bend[..., None]
    rate = slopes * speed[..., None]
    if taps == 1:
        return rate, change, np.zeros(samples.shape)
    earlier = _earlier(network, elements, time)
    return _passed(source, rate), _passed(source, change), _passed(source, earlier[..., None])[..., 0]


def _earlier(network: LocalNetwork, elements: Sequence[Element], time: Array) -> Array:
    """Y' (K, L) [m/s] at times before each element's start, over that at its start; nothing from there on."""
    starts = np.array([e.start for e in elements])[:, None]
    ahead = time < starts
    y_rate = network.inner_velocity(elements[0].piece, np.concatenate([time[ahead], starts[:, 0]]))
    earlier = np.zeros(time.shape)
    earlier[ahead] = y_rate[: -len(elements)] - np.broadcast_to(y_rate[-len(elements) :, None], time.shape)[ahead]
    return earlier


def _passed(source: Learned, values: Array) -> Array:
    """Values on the fine grid (K, L, C) as the force channel passes them, at the samples (K, S, C)."""
    windows = sliding_window_view(values, len(source.response), axis=1)[:, :: source.step]
    return np.asarray(np.einsum("ksct,t->ksc", windows, source.response[::-1]))


def _ranges(source: Learned, elements: Sequence[Element], late: float) -> list[range]:
    """Samples of each element."""
    h, thin = source.inputs.h, source.thin
    found = []
    for e in elements:
        first, last = int(np.ceil((e.start + late) / h)), int(np.ceil((e.end + late) / h))
        last += e.end >= source.span.end
        found.append(range(-(-first // thin) * thin, max(last, first), thin))
    return found


def _samples(source: Learned, elements: Sequence[Element], late: float) -> Indices:
    """(K, S) samples of each element, and some of the next where it has fewer than others."""
    ranges = _ranges(source, elements, late)
    most = max(max(len(r) for r in ranges), 1)
    return np.array([r.start for r in ranges])[:, None] + source.thin * np.arange(most)


def _counts(source: Learned, elements: Sequence[Element], samples: Indices, late: float) -> Array:
    """Weight of each sample: 0 beyond its element; one that stands for its neighbours weighs more."""
    train = source.piece.train
    stops = np.array([r.stop for r in _ranges(source, elements, late)])[:, None]
    inside = (samples >= 0) & (samples < np.minimum(stops, len(train)))
    return np.where(inside, train[np.clip(samples, 0, len(train) - 1)] * np.sqrt(source.thin), 0.0)

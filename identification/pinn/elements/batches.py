"""Batches of elements, with all quantities that do not change on one mesh.

Elements with similar numbers of samples are processed together, in few operations on large arrays.

In a force channel with a filter, y' passes through the filter's impulse response, on the filter's own fine grid
and once for each mesh. Field and displacement are slow compared with the filter, so they are only shifted by its
lag. Earlier elements contribute through the filter's memory; their part is taken from the present network.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from identification.arrays import Array
from identification.pinn.common import Batch, Indices, ResidualWeighting, TrainingPiece
from identification.pinn.elements.mesh import Element, ElementNetwork, Mesh
from identification.pinn.elements.quadrature import compute_gauss_points, make_weak_derivative

_LENGTH_RATIO = 1.35
"""Largest ratio of sample counts of the elements in a batch [1]."""
_MAX_BATCH_POINTS = 12_000
"""Largest number of points in a batch: above it, the allocator returns freed arrays to the system page by page."""
_LAST_TEST_WEIGHT = 0.1
"""Weight of the last test function [1], which the output weights cannot satisfy together with all others."""


def make_batches(
    pieces: Sequence[TrainingPiece],
    network: ElementNetwork,
    force_delay: float,
    points: int,
    weighting: ResidualWeighting = "galerkin",
) -> list[Batch]:
    """Return all elements of the learned pieces in batches.

    Args:
        force_delay: present estimate of the force channel's residual delay, with that of effects [s].
        points: number of Gauss points in an element.
        weighting: how law residuals enter the loss.
    """
    return [
        _make_batch(source, network, elements, force_delay, points, weighting)
        for number, source in enumerate(pieces)
        for elements in _group_by_length(source, network.mesh, network.mesh.find_elements(number))
    ]


def _group_by_length(source: TrainingPiece, mesh: Mesh, elements: Indices) -> Iterator[Indices]:
    """Yield groups of elements with similar lengths."""
    lengths = (
        np.array([mesh.elements[k].time_map.length for k in elements]) / source.inputs.h + 4.0 * source.decimation
    )
    order = np.argsort(lengths)
    start = 0
    for stop in range(1, len(order) + 1):
        is_full = (
            stop < len(order)
            and (stop + 1 - start) * lengths[order[stop]] * source.oversampling
            > _MAX_BATCH_POINTS * source.decimation
        )
        if stop == len(order) or is_full or lengths[order[stop]] > _LENGTH_RATIO * lengths[order[start]]:
            yield np.sort(elements[order[start:stop]])
            start = stop


def _make_batch(
    source: TrainingPiece,
    network: ElementNetwork,
    numbers: Indices,
    force_delay: float,
    points: int,
    weighting: ResidualWeighting,
) -> Batch:
    elements = [network.mesh.elements[k] for k in numbers]
    nodes, quadrature = compute_gauss_points(points)
    time = np.stack([e.start + e.time_map.invert(nodes) for e in elements])
    rate = np.stack([e.time_map.evaluate(e.time_map.invert(nodes))[1] for e in elements])
    delay = source.piece.force_delay + force_delay
    samples = _index_samples(source, elements, delay)
    sample_time: Array = np.asarray(samples * source.inputs.h - delay - source.lag)
    sample_rates, sample_curvatures, filter_memory = _evaluate_sample_basis(
        source, network, elements, samples, delay
    )
    inside = np.clip(samples, 0, len(source.piece.force) - 1)
    lengths = np.array([e.time_map.length for e in elements]) / source.inputs.h
    values = network.layer.evaluate(nodes)
    tests = _make_test_functions(values, network.layer.differentiate(nodes), np.sqrt(quadrature)[:, None])
    motion = source.inputs.evaluate_motion(time)
    if weighting == "weak_form":
        motion = motion[0], rate * _compute_weak_slopes(source, elements, points)
    return Batch(
        source=source,
        elements=numbers,
        left_node=network.mesh.left_nodes[numbers],
        time=time,
        basis=values,
        basis_rates=network.layer.differentiate(nodes) * rate[..., None],
        test_functions=tests,
        weighted_tests=np.eye(points)
        if weighting == "collocation"
        else np.hstack([tests[:, :-1], _LAST_TEST_WEIGHT * tests[:, -1:]]),
        point_weights=np.sqrt(quadrature * np.maximum(lengths, 1.0)[:, None]),
        slip_velocity=np.array([e.slip_velocity for e in elements]),
        motion=motion,
        samples=inside,
        sample_time=sample_time,
        sample_basis_rates=sample_rates,
        sample_basis_curvatures=sample_curvatures,
        filter_memory=filter_memory,
        sample_motion=source.inputs.evaluate_motion(sample_time),
        force=source.piece.force[inside],
        sample_weights=_weigh_samples(source, elements, samples, delay),
    )


def _make_test_functions(values: Array, slopes: Array, weight: Array) -> Array:
    """Return the test functions of the law residuals (Petrov-Galerkin): one for each output weight, and one more.

    Neighbouring elements share a node, so each element has one output weight fewer than basis functions. The
    derivatives of the basis functions span as many directions, because that of the constant is zero. The last test
    function keeps residuals from oscillating between these directions.
    """
    span = np.linalg.svd(weight * slopes, full_matrices=False)[0][:, :-1]
    remainder = weight * values - span @ (span.T @ (weight * values))
    return np.hstack([span, np.linalg.svd(remainder, full_matrices=False)[0][:, :1]])


def _compute_weak_slopes(source: TrainingPiece, elements: Sequence[Element], points: int) -> Array:
    """Return derivatives (K, M) [m] of the displacement over the input, without its velocity (research option)."""
    places, table = make_weak_derivative(points)
    x, _ = source.inputs.evaluate_motion(np.stack([e.start + e.time_map.invert(places) for e in elements]))
    return np.asarray(x @ table)


def _evaluate_sample_basis(
    source: TrainingPiece, network: ElementNetwork, elements: Sequence[Element], samples: Indices, delay: float
) -> tuple[Array, Array, Array]:
    """Return first and second time derivatives of the basis functions at the samples, and the filter memory."""
    time = _make_sample_grid(source, samples) * source.inputs.h / source.oversampling - delay
    inside = np.stack([np.clip(t, e.start, e.end) for t, e in zip(time, elements, strict=True)])
    mapped = [e.time_map.evaluate(t - e.start) for t, e in zip(inside, elements, strict=True)]
    place, speed, bend = (np.stack(values) for values in zip(*mapped, strict=True))
    slopes, curvatures = network.layer.differentiate_twice(place)
    change = curvatures * speed[..., None] ** 2 + slopes * bend[..., None]
    rate = slopes * speed[..., None]
    if len(source.impulse_response) == 1:
        return rate, change, np.zeros(samples.shape)
    earlier = _apply_filter(source, _compute_filter_memory(network, elements, time)[..., None])
    return _apply_filter(source, rate), _apply_filter(source, change), earlier[..., 0]


def _make_sample_grid(source: TrainingPiece, samples: Indices) -> Indices:
    """Return the indices (K, L) on the fine grid at which the force of samples (K, S) is evaluated.

    With a filter, they begin as early as its impulse response reaches back.
    """
    taps, grid = len(source.impulse_response), samples * source.oversampling
    if taps == 1:
        return grid
    return grid[:, :1] + np.arange(1 - taps, (samples.shape[1] - 1) * source.stride + 1)


def _compute_filter_memory(network: ElementNetwork, elements: Sequence[Element], time: Array) -> Array:
    """Return y' (K, L) [m/s] before each element's start, less that at its start; zero from the start on."""
    starts = np.array([e.start for e in elements])[:, None]
    is_earlier = time < starts
    y_rate = network.evaluate_inner_velocity(elements[0].piece, np.concatenate([time[is_earlier], starts[:, 0]]))
    earlier = np.zeros(time.shape)
    at_start = np.broadcast_to(y_rate[-len(elements) :, None], time.shape)
    earlier[is_earlier] = y_rate[: -len(elements)] - at_start[is_earlier]
    return earlier


def _apply_filter(source: TrainingPiece, values: Array) -> Array:
    """Return values on the fine grid (K, L, C), filtered as the force channel does, at the samples (K, S, C)."""
    windows = sliding_window_view(values, len(source.impulse_response), axis=1)[:, :: source.stride]
    return np.asarray(np.einsum("ksct,t->ksc", windows, source.impulse_response[::-1]))


def _find_sample_ranges(source: TrainingPiece, elements: Sequence[Element], delay: float) -> list[range]:
    """Return the samples of each element."""
    h, decimation = source.inputs.h, source.decimation
    ranges = []
    for e in elements:
        first, stop = int(np.ceil((e.start + delay) / h)), int(np.ceil((e.end + delay) / h))
        stop += e.end >= source.span.end
        ranges.append(range(-(-first // decimation) * decimation, max(stop, first), decimation))
    return ranges


def _index_samples(source: TrainingPiece, elements: Sequence[Element], delay: float) -> Indices:
    """Return samples (K, S) of each element; short elements are filled up with samples of the next one."""
    ranges = _find_sample_ranges(source, elements, delay)
    count = max(max(len(r) for r in ranges), 1)
    return np.array([r.start for r in ranges])[:, None] + source.decimation * np.arange(count)


def _weigh_samples(source: TrainingPiece, elements: Sequence[Element], samples: Indices, delay: float) -> Array:
    """Return the weight of each sample: 0 beyond its element, larger where it represents decimated ones."""
    train = source.piece.train
    stops = np.array([r.stop for r in _find_sample_ranges(source, elements, delay)])[:, None]
    inside = (samples >= 0) & (samples < np.minimum(stops, len(train)))
    return np.where(inside, train[np.clip(samples, 0, len(train) - 1)] * np.sqrt(source.decimation), 0.0)

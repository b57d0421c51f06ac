"""Inputs of the dense network: motion, lagged drive, time, and the position in the hysteresis loop.

All inputs are continuous in time, and each comes with its rate. The memory inputs use the time map of the network
of elements, centred at the breakthrough. Inputs that are odd in the slip's direction have its sign. Their value at
the end of one half stroke is therefore that at the beginning of the next.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.damper import Coordinates
from identification.pinn.common import (
    FEATURE_GROUPS,
    FeatureGroup,
    SlipVelocity,
    TimeMap,
    TrainingPiece,
    find_reversals,
    make_default_map,
    make_reversal_map,
    make_slip_times,
)

_LAG_RATES = (400.0, 200.0, 100.0)
"""Rates of the lagged drives [1/s]."""
_WIDTHS = (0.5, 1.0, 2.0, 4.0, 8.0)
"""Widths of memory inputs over that of the breakthrough [1]."""
_FADING_TIME = 2.0
"""Approximate time in which the inner displacement loses the memory of its initial value [s]."""

Columns = list[tuple[Array, Array]]
"""Inputs (N,) and their rates [1/s]."""


class NetworkInputs(NamedTuple):
    """Inputs (N, I) at some times of all pieces, and their rates [1/s]."""

    value: Array
    rate: Array


def compute_network_inputs(
    pieces: Sequence[TrainingPiece],
    times: Sequence[Array],
    slips: Sequence[SlipVelocity],
    c: Coordinates,
    features: Sequence[FeatureGroup] = FEATURE_GROUPS,
) -> NetworkInputs:
    """Return the inputs of all pieces, one piece below the other.

    Args:
        pieces: pieces that are learned.
        times: times (N,) in each piece [s].
        slips: slip velocity of each piece.
        c: present coordinates.
        features: groups of inputs.
    """
    inputs = []
    for number, (source, time, slip) in enumerate(zip(pieces, times, slips, strict=True)):
        groups = _make_column_groups(source, time, slip, c, number, len(pieces))
        columns = [column for name in FEATURE_GROUPS if name in features for column in groups[name]()]
        inputs.append(NetworkInputs(*(np.column_stack(part) for part in zip(*columns, strict=True))))
    return NetworkInputs(np.vstack([i.value for i in inputs]), np.vstack([i.rate for i in inputs]))


def _make_column_groups(
    source: TrainingPiece, time: Array, slip: SlipVelocity, c: Coordinates, number: int, count: int
) -> dict[FeatureGroup, Callable[[], Columns]]:
    """Return functions that compute the columns of each group."""
    return {
        "motion": lambda: _compute_motion_columns(source, time),
        "drive": lambda: _compute_drive_columns(source, time),
        "time": lambda: _compute_time_columns(
            time - source.span.start, source.span.end - source.span.start, number, count
        ),
        "memory": lambda: _compute_memory_columns(source, time, slip, c),
    }


def _compute_motion_columns(source: TrainingPiece, time: Array) -> Columns:
    """Return displacement, velocity, their product and the squared displacement."""
    x, v = source.inputs.evaluate_motion(time)
    a = source.inputs.evaluate_acceleration(time)
    middle = source.piece.excitation.displacement.mean()
    stroke = float(np.abs(source.piece.excitation.displacement - middle).max())
    rms_velocity = source.inputs.rms_velocity
    place, speed = (x - middle) / stroke, v / rms_velocity
    return [
        (place, v / stroke),
        (speed, a / rms_velocity),
        (place * speed, v / stroke * speed + place * a / rms_velocity),
        (place**2, 2.0 * place * v / stroke),
    ]


def _compute_drive_columns(source: TrainingPiece, time: Array) -> Columns:
    """Return the fields that would follow the drive at several rates."""
    drive = source.inputs.evaluate_drive(time, source.piece.drive_delay)
    fields = [(rate, source.inputs.evaluate_field(time, rate, source.piece.drive_delay).u) for rate in _LAG_RATES]
    return [(lagged, -rate * (lagged - drive)) for rate, lagged in fields]


def _compute_time_columns(since: Array, length: float, number: int, count: int) -> Columns:
    """Return time and its decay in columns of each piece, because each piece has another initial value."""
    one, zero = np.ones_like(since), np.zeros_like(since)
    columns = []
    for piece in range(count):
        is_own = float(piece == number)
        decay = is_own * np.exp(-since / _FADING_TIME)
        columns += [
            (is_own * (2.0 * since / length - 1.0), is_own * one * 2.0 / length),
            (decay, -decay / _FADING_TIME),
        ]
        if count > 1:
            columns.append((is_own * one, zero))
    return columns


def _compute_memory_columns(source: TrainingPiece, time: Array, slip: SlipVelocity, c: Coordinates) -> Columns:
    """Return eight functions of the position in the hysteresis loop."""
    grid = np.arange(source.span.start, source.span.end, source.inputs.h)
    edges = np.concatenate([[source.span.start], find_reversals(grid, slip(grid), c.D_y), [source.span.end]])
    values, rates = np.zeros((3 + len(_WIDTHS), len(time))), np.zeros((3 + len(_WIDTHS), len(time)))
    which = np.clip(np.searchsorted(edges, time, side="right") - 1, 0, len(edges) - 2)
    for k in np.unique(which):
        mask, length = which == k, float(edges[k + 1] - edges[k])
        slip_times = make_slip_times(length)
        velocity = slip(edges[k] + slip_times)
        time_map = make_reversal_map(length, slip_times, velocity, c.D_y) if k else make_default_map(length)
        direction = float(np.sign(np.trapezoid(velocity, slip_times))) or 1.0
        values[:, mask], rates[:, mask] = _compute_memory_functions(time_map, time[mask] - edges[k], direction)
    return list(zip(values, rates, strict=True))


def _compute_memory_functions(time_map: TimeMap, since: Array, direction: float) -> tuple[Array, Array]:
    """Return functions (8, N) of the time since a reversal, and their rates."""
    place, rate, _ = time_map.evaluate(since)
    o, o_rate = 2.0 * place - 1.0, 2.0 * rate
    angle = 0.5 * np.pi * o
    rows = [(direction * o, direction * o_rate), (o**2, 2.0 * o * o_rate)]
    rows.append(
        (direction * np.sin(angle) ** 3, direction * 1.5 * np.pi * np.sin(angle) ** 2 * np.cos(angle) * o_rate)
    )
    for width in _WIDTHS:
        scale = width * time_map.width

        def step(t: Array | float, scale: float = scale) -> Array:
            return np.asarray(np.tanh((t - time_map.centre) / scale))

        first, last = step(0.0), step(time_map.length)
        gain = direction * 2.0 / max(float(last - first), 1e-9)
        rows.append((gain * (step(since) - first) - direction, gain * (1.0 - step(since) ** 2) / scale))
    return np.array([value for value, _ in rows]), np.array([r for _, r in rows])

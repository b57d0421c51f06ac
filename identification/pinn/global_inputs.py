"""What the global network is shown: motion, time, lagged drive, and where in its loop the hysteresis is.

All inputs are continuous in time, and each comes with its rate. The memory inputs are the local network's,
centred where the slip breaks through; those that are odd in the direction carry it, so that the value at the end
of one half stroke is that at the beginning of the next.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.damper.coordinates import Coordinates
from identification.pinn.batches import Learned
from identification.pinn.memory_input import MemoryInput, after_reversal, anywhere
from identification.pinn.mesh import SlipVelocity
from identification.pinn.reversals import reversals
from identification.pinn.settings import GROUPS, Group

_LAG_RATES = (400.0, 200.0, 100.0)
"""[1/s] of the lagged drives."""
_WIDTHS = (0.5, 1.0, 2.0, 4.0, 8.0)
"""[1] of the breakthrough's own."""
_FADES = 2.0
"""[s] in which the inner displacement forgets its start, roughly."""
_SLIP_POINTS = 150


Columns = list[tuple[Array, Array]]
"""Inputs (N,) and their rates [1/s]."""


class Shown(NamedTuple):
    """Inputs (N, I) at some times of all pieces, and their rates [1/s]."""

    value: Array
    rate: Array


def network_inputs(
    pieces: Sequence[Learned], times: Sequence[Array], slips: Sequence[SlipVelocity], c: Coordinates,
    features: Sequence[Group] = GROUPS,
) -> Shown:  # fmt: skip
    """Inputs of all pieces, one below the other.

    Args:
        pieces: what is learned.
        times: (N,) of each [s].
        slips: slip velocity of each.
        c: present coordinates.
        features: groups that are shown.
    """
    shown = []
    for number, (source, time, slip) in enumerate(zip(pieces, times, slips, strict=True)):
        groups = _of_piece(source, time, slip, c, number, len(pieces))
        columns = [column for name in GROUPS if name in features for column in groups[name]()]
        shown.append(Shown(*(np.column_stack(part) for part in zip(*columns, strict=True))))
    return Shown(np.vstack([s.value for s in shown]), np.vstack([s.rate for s in shown]))


def _of_piece(
    source: Learned, time: Array, slip: SlipVelocity, c: Coordinates, number: int, count: int
) -> dict[Group, Callable[[], Columns]]:
    """Each group's columns, made when asked for."""
    return {
        "motion": lambda: _of_motion(source, time),
        "drive": lambda: _of_drive(source, time),
        "time": lambda: _of_time(time - source.span.start, source.span.end - source.span.start, number, count),
        "memory": lambda: _memory(source, time, slip, c),
    }


def _of_motion(source: Learned, time: Array) -> Columns:
    """Place, speed and two of their products."""
    inputs, h = source.inputs, source.inputs.h
    x, v = inputs.motion(time)
    a = (inputs.motion(time + 0.5 * h)[1] - inputs.motion(time - 0.5 * h)[1]) / h
    middle = source.piece.stroke.displacement.mean()
    stroke = float(np.abs(source.piece.stroke.displacement - middle).max())
    usual = inputs.usual_velocity
    place, speed = (x - middle) / stroke, v / usual
    return [
        (place, v / stroke),
        (speed, a / usual),
        (place * speed, v / stroke * speed + place * a / usual),
        (place**2, 2.0 * place * v / stroke),
    ]


def _of_drive(source: Learned, time: Array) -> Columns:
    """The drive as fields of several rates would follow it."""
    held = source.inputs.drive(time, source.piece.drive_delay)
    fields = [(rate, source.inputs.field(time, rate, source.piece.drive_delay).u) for rate in _LAG_RATES]
    return [(lagged, -rate * (lagged - held)) for rate, lagged in fields]


def _of_time(since: Array, length: float, number: int, count: int) -> Columns:
    """Time and its fading, apart for each piece, for each has forgotten another start."""
    one, zero = np.ones_like(since), np.zeros_like(since)
    columns = []
    for piece in range(count):
        mine = float(piece == number)
        fading = mine * np.exp(-since / _FADES)
        columns += [(mine * (2.0 * since / length - 1.0), mine * one * 2.0 / length), (fading, -fading / _FADES)]
        if count > 1:
            columns.append((mine * one, zero))
    return columns


def _memory(source: Learned, time: Array, slip: SlipVelocity, c: Coordinates) -> Columns:
    """Eight functions of the way through the loop."""
    grid = np.arange(source.span.start, source.span.end, source.inputs.h)
    edges = np.concatenate([[source.span.start], reversals(grid, slip(grid), c.D_y), [source.span.end]])
    values, rates = np.zeros((3 + len(_WIDTHS), len(time))), np.zeros((3 + len(_WIDTHS), len(time)))
    which = np.clip(np.searchsorted(edges, time, side="right") - 1, 0, len(edges) - 2)
    for k in np.unique(which):
        here, length = which == k, float(edges[k + 1] - edges[k])
        points = length * np.linspace(0.0, 1.0, _SLIP_POINTS) ** 1.5
        along = slip(edges[k] + points)
        memory = after_reversal(length, points, along, c.D_y) if k else anywhere(length)
        direction = float(np.sign(np.trapezoid(along, points))) or 1.0
        values[:, here], rates[:, here] = _functions(memory, time[here] - edges[k], direction)
    return list(zip(values, rates, strict=True))


def _functions(memory: MemoryInput, since: Array, direction: float) -> tuple[Array, Array]:
    """(8, N) functions of the time since a reversal, and their rates."""
    place, rate, _ = memory.at(since)
    o, o_rate = 2.0 * place - 1.0, 2.0 * rate
    angle = 0.5 * np.pi * o
    rows = [(direction * o, direction * o_rate), (o**2, 2.0 * o * o_rate)]
    rows.append(
        (direction * np.sin(angle) ** 3, direction * 1.5 * np.pi * np.sin(angle) ** 2 * np.cos(angle) * o_rate)
    )
    for width in _WIDTHS:
        scale = width * memory.width

        def step(t: Array | float, scale: float = scale) -> Array:
            return np.asarray(np.tanh((t - memory.centre) / scale))

        first, last = step(0.0), step(memory.length)
        gain = direction * 2.0 / max(float(last - first), 1e-9)
        rows.append((gain * (step(since) - first) - direction, gain * (1.0 - step(since) ** 2) / scale))
    return np.array([value for value, _ in rows]), np.array([r for _, r in rows])

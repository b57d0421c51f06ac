"""Cycles in which the rod did not repeat its stroke: the recording itself is bad there, whatever the damper does.

A drive whose setpoints come late, or a knock, moves the rod within milliseconds. Between samples nobody knows
where it was then, and a force that is steep over some micrometres cannot be simulated. A damper's own faults move
the rod by what the actuator gives under them: far less.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from identification.arrays import Array, BoolArray
from identification.gap.residual import Cycles, by_piece
from identification.piece import Piece

Indices = npt.NDArray[np.intp]

_ORDERS = 12
"""Harmonics that every cycle has in common."""
_PARTS = 50
"""Parts of a cycle in which it is compared with the others."""
_ROUNDING = 1e-9
"""[cycles]"""
_OFF = 0.004
"""[1] of the stroke's deviation by which a cycle that stumbled jerks at least from one part to the next."""
_BEYOND = 5.0
"""[1] times as much as the best tenth of all cycles."""
_MOST = 0.5
"""[1] part of the cycles that may be left out."""


def left_out(pieces: Sequence[Piece], cycles: Cycles) -> tuple[tuple[Piece, ...], list[str]]:
    """The pieces without cycles that stumbled, and what to say of them.

    Where most of them did, all are kept, and that is said.
    """
    off = cycle_to_cycle(pieces, cycles)
    known = np.isfinite(off)
    if not known.any():
        return tuple(pieces), []
    stroke = float(np.std(np.concatenate([p.stroke.displacement for p in pieces])))
    limit = max(_OFF * stroke, _BEYOND * float(np.quantile(off[known], 0.1)))
    bad = _not_only_at_the_ends(known & (off > limit), cycles)
    if not bad.any():
        return tuple(pieces), []
    said = (
        f"the rod did not repeat its stroke in {np.count_nonzero(bad)} of {cycles.count} cycles (it jerks by up "
        f"to {1e6 * off[bad].max():.3g} µm, {1e6 * limit:.2g} µm at most are usual): late setpoints or a knock"
    )
    if bad.mean() > _MOST:
        return tuple(pieces), [
            f"{said}; the recording itself is bad, and so is what is said of its gap: record again"
        ]
    return _without(pieces, cycles, bad), [f"{said}; they are left out"]


def _not_only_at_the_ends(bad: BoolArray, cycles: Cycles) -> BoolArray:
    """The cycles (cycles,) that stumbled, but not where it may have been the stroke that began or ended.

    A stumble that began in the segment before, or goes on in the next, is one.
    """
    found = bad.copy()
    for number in np.unique(cycles.segment[bad]):
        mine = np.flatnonzero(cycles.segment == number)
        found[mine] &= bad[mine[1:-1]].any()
    goes_on = np.convolve(found, [1, 0, 1], "same") > 0
    return np.asarray(found | (bad & goes_on))


def _without(pieces: Sequence[Piece], cycles: Cycles, bad: BoolArray) -> tuple[Piece, ...]:
    inside = np.where(cycles.cycle >= 0, bad[cycles.cycle], False)
    parts = by_piece(inside, pieces)
    return tuple(replace(p, train=np.where(m, 0.0, p.train)) for p, m in zip(pieces, parts, strict=True))


def cycle_to_cycle(pieces: Sequence[Piece], cycles: Cycles) -> Array:
    """(cycles,) [m] by which each jerks beside the middle one of its segment; NaN where none repeats."""
    x = np.concatenate([p.stroke.displacement for p in pieces])
    off = np.full(cycles.count, np.nan)
    owner = np.where(cycles.cycle >= 0, cycles.segment[cycles.cycle], -1)
    for number, condition in enumerate(cycles.conditions):
        mine = np.flatnonzero(owner == number)
        if condition.frequency and len(mine) > 4 * _ORDERS:
            # Counted from where the cycles are cut, so that no part of one reaches into the next.
            phase = (cycles.phase[mine] - cycles.phase[mine[0]] + _ROUNDING) % 1.0
            names, distances = _distances(x[mine], cycles.cycle[mine], phase)
            off[names] = distances
    return off


def _distances(x: Array, cycle: Indices, phase: Array) -> tuple[Indices, Array]:
    """Names of the cycles of a segment, and how far each jerks beside their middle [m]."""
    names, place = np.unique(cycle, return_inverse=True)
    if len(names) < 3:
        return names, np.full(len(names), np.nan)
    rest, grid = x - _common(x, phase), (np.arange(_PARTS) + 0.5) / _PARTS
    table = np.stack([np.interp(grid, phase[place == k], rest[place == k]) for k in range(len(names))])
    # A soft start is off as well, but smoothly: third differences leave a five-hundredth of it.
    jerks = np.diff(table, 3, axis=1)
    return names, np.sqrt(np.mean((jerks - np.median(jerks, axis=0)) ** 2, axis=1))


def _common(x: Array, phase: Array) -> Array:
    """The harmonics (n,) [m] that all cycles have in common, at a frequency that may be off the planned one."""
    turn = 2.0 * np.pi * np.outer(np.arange(1, _ORDERS + 1), phase)
    time = np.linspace(-1.0, 1.0, len(x))
    waves = np.vstack([np.cos(turn), np.sin(turn)])
    basis = np.vstack([np.ones(len(x)), time, waves, waves[[0, _ORDERS]] * time])
    return np.asarray(np.linalg.lstsq(basis @ basis.T, basis @ x, rcond=1e-10)[0] @ basis)

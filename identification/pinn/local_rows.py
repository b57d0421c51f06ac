"""Rows of the local network's least squares: force misfit at the samples, residuals of the law between them.

The residuals of the law are asked for in the mean, weighed with the functions of the element themselves
(Galerkin's method): what these cannot follow, such as the roughness of a measured velocity, is asked of nobody.
Asked for point by point it would pull at the parameters, and multipliers would add it up without end.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.damper.coordinates import Coordinates
from identification.pinn import law_rows
from identification.pinn.batches import Batch
from identification.pinn.inputs import Field
from identification.pinn.mesh import Y_UNIT, Heads
from identification.problem import COORDINATE_COUNT, Problem

UNKNOWNS = COORDINATE_COUNT + 2
"""Search numbers, and the delays of force and drive channel in units of their prior."""
Z_SCALE, BALANCE_SCALE = 0.7, 10.0
"""[1] a hysteresis residual of this part of the slip velocity at breakthrough, and a balance residual of ten times
the force noise, weigh as much as one deviation of a sample."""
_ETA = Coordinates._fields.index("eta")
_FORCE_DELAY, _DRIVE_DELAY = COORDINATE_COUNT, COORDINATE_COUNT + 1


class Weights(NamedTuple):
    """How the parts of the loss are weighed."""

    physics: float
    """[1] of the law's residuals against the force misfit."""
    noise: float
    """[N] that a force misfit is measured by."""


@dataclass(frozen=True)
class Rows:
    """Weighted residuals of a batch, and their slopes if asked for."""

    hysteresis: Array
    """(K, rank)"""
    balance: Array
    misfit: Array
    """(K, S)"""
    slopes: Array | None = None
    """(K, 2 rank + S, 2 rank + 15) over the heads of z, of y, and the unknowns that all share."""

    @property
    def all(self) -> Array:
        """All of them, (K, 2 rank + S)."""
        return np.concatenate([self.hysteresis, self.balance, self.misfit], 1)

    def pulled(self, pull: "Rows") -> "Rows":
        """With the residuals of the law that multipliers add; without end, were the last test among them."""
        hysteresis, balance = self.hysteresis.copy(), self.balance.copy()
        hysteresis[:, :-1] += pull.hysteresis[:, :-1]
        balance[:, :-1] += pull.balance[:, :-1]
        return replace(self, hysteresis=hysteresis, balance=balance)


class _Point(NamedTuple):
    """The shared unknowns, resolved."""

    coordinates: Coordinates
    over_search: Array
    """(13, 13) slopes of the coordinates over the search numbers."""
    force_delay: float
    """[s] beyond what the instruments report and the batches were made with."""
    drive_delay: float
    """[s] beyond what the instruments report."""


class _Part(NamedTuple):
    """One kind of residual at a batch's points, and its slopes over what stands in it, by name."""

    value: Array
    over: dict[str, Array]
    """Empty unless asked for."""
    field: Field


@dataclass(frozen=True)
class LocalLoss:
    """What the local network is trained on."""

    problem: Problem
    batches: Sequence[Batch]
    made_with: float
    """[s] force delay that the batches' grids were made with."""

    def rows(
        self, unknowns: Array, heads: Heads, weights: Weights, pull: Sequence[Rows] | None = None, *, slopes: bool
    ) -> list[Rows]:
        """The rows of every batch.

        Args:
            unknowns: (15,)
            heads: of all elements.
            weights: of the parts.
            pull: residuals of the law that multipliers add, one for each batch.
            slopes: also the Jacobian.
        """
        point = self._point(unknowns)
        pulls: Sequence[Rows | None] = pull or [None] * len(self.batches)
        return [self._rows(b, point, heads, weights, p, slopes) for b, p in zip(self.batches, pulls, strict=True)]

    def _point(self, unknowns: Array) -> _Point:
        q, space = unknowns[:COORDINATE_COUNT], self.problem.space
        force_delay, drive_delay = unknowns[COORDINATE_COUNT:] * self.problem.delay_prior
        return _Point(
            space.to_coordinates(q), space.slopes(q), float(force_delay) - self.made_with, float(drive_delay)
        )

    def residuals(self, unknowns: Array, heads: Heads) -> Iterator[tuple[Array, Array, Array]]:
        """Of each batch, without weights: eq. 3 [m/s] and eq. 4 [N] at the points, force [N] at the samples."""
        point = self._point(unknowns)
        for b in self.batches:
            hysteresis, balance = self._law(b, point, heads, slopes=False)
            yield hysteresis.value, balance.value, self._force(b, point, heads, slopes=False).value - b.force

    def _rows(
        self, b: Batch, point: _Point, heads: Heads, weights: Weights, pull: Rows | None, slopes: bool
    ) -> Rows:  # fmt: skip
        hysteresis, balance = self._law(b, point, heads, slopes)
        force = self._force(b, point, heads, slopes)
        by_law = weights.physics * b.share
        scales = (
            by_law / (Z_SCALE * b.slip_velocity[:, None]),
            by_law / (BALANCE_SCALE * weights.noise),
            b.counts / weights.noise,
        )
        found = Rows(
            (hysteresis.value * scales[0]) @ b.asked,
            (balance.value * scales[1]) @ b.asked,
            (force.value - b.force) * scales[2],
        )
        if slopes:
            found = replace(found, slopes=self._slopes(b, point, (hysteresis, balance, force), scales))
        return found if pull is None else found.pulled(pull)

    def _law(self, b: Batch, point: _Point, heads: Heads, slopes: bool) -> tuple[_Part, _Part]:
        """Residuals of eqs. 3 and 4 at a batch's points."""
        z, y = heads.of(b.left, b.elements)
        field = _field(b, b.time, point)
        values = point.coordinates._asdict() | {
            "z": z @ b.values.T,
            "z_rate": _head(b.slopes, z),
            "y": y @ b.values.T * Y_UNIT,
            "y_rate": _head(b.slopes, y) * Y_UNIT,
            "x": b.motion[0],
            "v": b.motion[1],
            "u": field.u,
        }
        return (
            _Part(
                law_rows.hysteresis(values), law_rows.hysteresis_slopes(values, np.log) if slopes else {}, field
            ),
            _Part(law_rows.balance(values), law_rows.balance_slopes(values) if slopes else {}, field),
        )

    def _force(self, b: Batch, point: _Point, heads: Heads, slopes: bool) -> _Part:
        """The network's force at a batch's samples, as the channel records it."""
        _, y = heads.of(b.left, b.elements)
        shift = point.force_delay
        x, v = b.sample_motion
        field = _field(b, b.sample_time - shift, point)
        change = _head(b.sample_change, y) * Y_UNIT
        values = point.coordinates._asdict() | {
            "y_rate": _head(b.sample_rate, y) * Y_UNIT - shift * change + b.before,
            "x": x - shift * v,
            "u": field.u,
        }
        if not slopes:
            return _Part(law_rows.force(values), {}, field)
        over = law_rows.force_slopes(values)
        over["time"] = over["y_rate"] * change + over["x"] * v
        return _Part(law_rows.force(values), over, field)

    def _slopes(
        self, b: Batch, point: _Point, parts: tuple[_Part, _Part, _Part], scales: tuple[Array, Array, Array]
    ) -> Array:
        """The Jacobian of a batch, filled block by block."""
        hysteresis, balance, force = (
            {name: over * scale for name, over in part.over.items()}
            for part, scale in zip(parts, scales, strict=True)
        )
        points, rank = b.values.shape
        z, y = slice(rank), slice(rank, 2 * rank)
        law = np.zeros((2, len(b.elements), points, 2 * rank + UNKNOWNS))
        law[0, ..., z] = hysteresis["z"][..., None] * b.values + hysteresis["z_rate"][..., None] * b.slopes
        law[0, ..., y] = Y_UNIT * hysteresis["y_rate"][..., None] * b.slopes
        law[1, ..., z] = balance["z"][..., None] * b.values
        law[1, ..., y] = Y_UNIT * (balance["y"][..., None] * b.values + balance["y_rate"][..., None] * b.slopes)
        samples = np.zeros((len(b.elements), b.counts.shape[1], 2 * rank + UNKNOWNS))
        rate = b.sample_rate - point.force_delay * b.sample_change if point.force_delay else b.sample_rate
        samples[..., y] = Y_UNIT * force["y_rate"][..., None] * rate
        for table, over, part in zip((*law, samples), (hysteresis, balance, force), parts, strict=True):
            table[..., 2 * rank :] = self._shared(over, part.field, point)
        return np.concatenate([*(b.asked.T @ law), samples], 1)

    def _shared(self, over: dict[str, Array], field: Field, point: _Point) -> Array:
        """(K, M, 15) slopes over the unknowns that all elements share."""
        table = np.zeros((*field.u.shape, UNKNOWNS))
        for i, name in enumerate(Coordinates._fields):
            if name in over:
                table[..., i] = over[name]
        if "u" in over:
            late = over["u"] * field.over_delay
            table[..., _ETA] = over["u"] * field.over_eta
            table[..., _DRIVE_DELAY] = self.problem.delay_prior * late
            # A force that comes late shows an older motion and an older field.
            table[..., _FORCE_DELAY] = self.problem.delay_prior * (late - over["time"]) if "time" in over else 0.0
        table[..., :COORDINATE_COUNT] = table[..., :COORDINATE_COUNT] @ point.over_search
        return table


def _field(b: Batch, time: Array, point: _Point) -> Field:
    return b.source.inputs.field(time, point.coordinates.eta, b.source.piece.drive_delay + point.drive_delay)


def _head(functions: Array, heads: Array) -> Array:
    """(K, M) of functions (K, M, rank) and heads (K, rank)."""
    return np.asarray((functions @ heads[..., None])[..., 0])

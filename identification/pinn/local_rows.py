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
from identification.pinn.effect_terms import Acting, Driven
from identification.pinn.mesh import Y_UNIT, Heads
from identification.problem import COMMON_COUNT, COORDINATE_COUNT, Problem

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
    """(K, 2 rank + S, 2 rank + C) over the heads of z, of y, and the C unknowns that all share."""

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
    """The shared unknowns as one log has them, resolved."""

    coordinates: Coordinates
    over_search: Array
    """(13, 13 + O) slopes of the coordinates over the search numbers, and over what logs have of their own."""
    force_delay: float
    """[s] beyond what the instruments report and the batches were made with."""
    drive_delay: float
    """[s] beyond what the instruments report."""
    over_values: Array
    """(P,) slopes of the effects' parameters over their search numbers."""
    acting: Acting | None
    """The effects; None where there are none."""


class _Part(NamedTuple):
    """One kind of residual at a batch's points, and its slopes over what stands in it, by name."""

    value: Array
    over: dict[str, Array]
    """Empty unless asked for."""
    driven: Driven


@dataclass(frozen=True)
class LocalLoss:
    """What the local network is trained on; its unknowns are those that all pieces of the problem share."""

    problem: Problem
    batches: Sequence[Batch]
    made_with: float
    """[s] force delay, with that of the effects, that the batches' grids were made with."""

    def rows(
        self, unknowns: Array, heads: Heads, weights: Weights, pull: Sequence[Rows] | None = None, *, slopes: bool
    ) -> list[Rows]:
        """The rows of every batch.

        Args:
            unknowns: (C,) that all elements share.
            heads: of all elements.
            weights: of the parts.
            pull: residuals of the law that multipliers add, one for each batch.
            slopes: also the Jacobian.
        """
        points = self._points(unknowns)
        pulls: Sequence[Rows | None] = pull or [None] * len(self.batches)
        return [
            self._rows(b, point, heads, weights, p, slopes)
            for b, point, p in zip(self.batches, points, pulls, strict=True)
        ]

    def _points(self, unknowns: Array) -> list[_Point]:
        """The shared unknowns as the log of each batch has them."""
        point = self._point(unknowns)
        if not self.problem.own:
            return [point] * len(self.batches)
        logs = {b.source.number: self._of_log(point, unknowns, b.source.number) for b in self.batches}
        return [logs[b.source.number] for b in self.batches]

    def _of_log(self, point: _Point, unknowns: Array, piece: int) -> _Point:
        condition = self.problem.condition(unknowns, piece)
        common = np.hstack([point.over_search, self.problem.own_slopes(unknowns, piece)])
        return point._replace(
            coordinates=condition.of(point.coordinates), over_search=condition.chained(common.T).T
        )

    def _point(self, unknowns: Array) -> _Point:
        q, space = unknowns[:COORDINATE_COUNT], self.problem.space
        late, drive_delay = self.problem.further_delays(unknowns)
        over_values, acting = self.problem.effect_slopes(self.problem.whole(unknowns)), None
        if self.problem.effects:
            sources = {b.source.number: b.source for b in self.batches}
            acting = Acting(self.problem, list(sources.values()), unknowns)
            late += acting.lateness
        return _Point(
            space.to_coordinates(q), space.slopes(q), late - self.made_with, drive_delay, over_values, acting
        )

    def residuals(self, unknowns: Array, heads: Heads) -> Iterator[tuple[Array, Array, Array]]:
        """Of each batch, without weights: eq. 3 [m/s] and eq. 4 [N] at the points, force [N] at the samples."""
        for b, point in zip(self.batches, self._points(unknowns), strict=True):
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
        driven = _driven_at_points(b, point)
        values = point.coordinates._asdict() | {
            "z": z @ b.values.T,
            "z_rate": _head(b.slopes, z),
            "y": y @ b.values.T * Y_UNIT,
            "y_rate": _head(b.slopes, y) * Y_UNIT,
            "x": b.motion[0],
            "v": b.motion[1],
            "u": driven.field.u,
        } | driven.values  # fmt: skip
        over = law_rows.hysteresis_slopes(values, np.log) if slopes else {}
        over_too = law_rows.balance_slopes(values) if slopes else {}
        if slopes and point.acting:
            over["v"] = -over["y_rate"]
            over_too |= law_rows.balance_slopes_over_inputs(values)
        return (
            _Part(law_rows.hysteresis(values), over, driven),
            _Part(law_rows.balance(values), over_too, driven),
        )

    def _force(self, b: Batch, point: _Point, heads: Heads, slopes: bool) -> _Part:
        """The network's force at a batch's samples, as the channel records it."""
        _, y = heads.of(b.left, b.elements)
        driven = _driven_at_samples(b, point)
        change = _head(b.sample_change, y) * Y_UNIT
        values = point.coordinates._asdict() | {
            "y_rate": _head(b.sample_rate, y) * Y_UNIT - point.force_delay * change + b.before,
            "u": driven.field.u,
        } | driven.values  # fmt: skip
        if not slopes:
            return _Part(law_rows.force(values), {}, driven)
        over = law_rows.force_slopes(values)
        if point.acting:
            over |= law_rows.force_slopes_over_inputs(values)
        # A force that comes late shows an older motion and an older field.
        late = {"y_rate": -driven.later[:, None, None] * change}
        return _Part(law_rows.force(values), over, driven._replace(over=driven.over | late))

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
        shared = len(self.problem.shared)
        law = np.zeros((2, len(b.elements), points, 2 * rank + shared))
        law[0, ..., z] = hysteresis["z"][..., None] * b.values + hysteresis["z_rate"][..., None] * b.slopes
        law[0, ..., y] = Y_UNIT * hysteresis["y_rate"][..., None] * b.slopes
        law[1, ..., z] = balance["z"][..., None] * b.values
        law[1, ..., y] = Y_UNIT * (balance["y"][..., None] * b.values + balance["y_rate"][..., None] * b.slopes)
        samples = np.zeros((len(b.elements), b.counts.shape[1], 2 * rank + shared))
        rate = b.sample_rate - point.force_delay * b.sample_change if point.force_delay else b.sample_rate
        samples[..., y] = Y_UNIT * force["y_rate"][..., None] * rate
        for table, over, part in zip((*law, samples), (hysteresis, balance, force), parts, strict=True):
            table[..., 2 * rank :] = self._shared(over, part.driven, point)
        return np.concatenate([*(b.asked.T @ law), samples], 1)

    def _shared(self, over: dict[str, Array], driven: Driven, point: _Point) -> Array:
        """(K, M, C) slopes over the unknowns that all elements share."""
        table = np.zeros((*driven.field.u.shape, len(self.problem.shared)))
        coordinates = table[..., :COORDINATE_COUNT]
        for i, name in enumerate(Coordinates._fields):
            if name in over:
                coordinates[..., i] = over[name]
        if "u" in over:
            coordinates[..., _ETA] = over["u"] * driven.field.over_eta
            table[..., _DRIVE_DELAY] = self.problem.delay_prior * over["u"] * driven.field.over_delay
        for name in driven.over.keys() & over.keys():
            late, *own = driven.over[name]
            table[..., _FORCE_DELAY] += self.problem.delay_prior * over[name] * late
            for k, row in enumerate(own):
                table[..., COMMON_COUNT + k] += over[name] * row * point.over_values[k]
        searched = coordinates @ point.over_search
        coordinates[...] = searched[..., :COORDINATE_COUNT]
        table[..., COMMON_COUNT + len(point.over_values) :] = searched[..., COORDINATE_COUNT:]
        return table


def _driven_at_points(b: Batch, point: _Point) -> Driven:
    if point.acting:
        return point.acting.at_points(b)
    field = b.source.inputs.field(b.time, point.coordinates.eta, b.source.piece.drive_delay + point.drive_delay)
    return Driven(field, {}, {}, np.ones(1))


def _driven_at_samples(b: Batch, point: _Point) -> Driven:
    if point.acting:
        return point.acting.at_samples(b)
    x, v = b.sample_motion
    late = b.source.piece.drive_delay + point.drive_delay
    field = b.source.inputs.field(b.sample_time - point.force_delay, point.coordinates.eta, late)
    over = {"x": -v[None], "u": field.over_delay[None]}
    return Driven(field, {"x": x - point.force_delay * v}, over, np.ones(1))


def _head(functions: Array, heads: Array) -> Array:
    """(K, M) of functions (K, M, rank) and heads (K, rank)."""
    return np.asarray((functions @ heads[..., None])[..., 0])

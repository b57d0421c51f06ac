"""The terms that effects beside the law bring into the network's residuals.

An effect changes what drives the law (field, motion, factors of its dampings) or what the load cell shows beside
it. Both follow from a recording's inputs alone, by the functions that the simulation uses outside its march; no
state of the law enters, and nothing is simulated. Where the damper's own motion depends on its force or on its
past, in a mounting with give or play, it would be a third state of the network: such effects it does not take.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.damper.effects import Action, Form
from identification.pinn.batches import Batch, Learned
from identification.pinn.inputs import Field
from identification.problem import COMMON_COUNT, COORDINATE_COUNT, Problem
from identification.simulate import ActiveEffect, Setting, Stroke
from identification.simulate.channel import beside, beside_slopes, recorded
from identification.simulate.inputs import damper_field
from identification.simulate.motion import Motion, damper_motion
from identification.simulate.scaling import factors

_BEYOND: tuple[Action, ...] = ("displacement_follower", "connection", "force_lag")
"""Play and give, and a lag that would have to pass the network's force, too."""
_FACTORS = ("F_factor", "c0_factor", "c1_factor")

Rows = dict[str, Array]
"""Slopes of inputs, by the input's name: over the force's delay, then over each parameter of the effects."""


class Driven(NamedTuple):
    """What stands in the residuals beside states and coordinates, at some points."""

    field: Field
    values: dict[str, Array]
    """By name: ``x`` [m], ``v`` [m/s], factors [1], force ``beside`` the law [N]."""
    over: Rows
    """Of these and of the field ``u``."""
    later: Array
    """(1 + P,) how much later each makes the network's force, 1 for a delay."""

    def looked_up(self, table: Callable[[Array], Array]) -> "Driven":
        """The same at other points, every array looked up in the same way."""
        return Driven(
            Field(*(table(row) for row in self.field)),
            {name: table(row) for name, row in self.values.items()},
            {name: table(rows) for name, rows in self.over.items()},
            self.later,
        )


def takes(form: Form) -> bool:
    """Whether an effect of this form can be a term of the residual."""
    return form.acts not in _BEYOND


class Acting:
    """The effects of a problem at one point, seen along each of its pieces.

    Args:
        problem: with the effects.
        sources: its pieces as the network sees them.
        unknowns: (C,) shared by all elements.
    """

    def __init__(self, problem: Problem, sources: Sequence[Learned], unknowns: Array) -> None:
        coordinates = problem.space.to_coordinates(unknowns[:COORDINATE_COUNT])
        effects = problem.active_effects(problem.whole(unknowns))
        force, drive = problem.further_delays(unknowns)
        self.lateness = lateness(effects)
        """[s] by which the effects make the force later than the motion as it was recorded."""
        self._along = {
            s.number: _PieceTerms(
                Setting(
                    coordinates,
                    force_delay=s.piece.force_delay + s.lag + force,
                    drive_delay=s.piece.drive_delay + drive,
                    effects=effects,
                ),
                s,
            )
            for s in sources
        }

    def at_points(self, b: Batch) -> Driven:
        """Where the law is asked for."""
        return self._along[b.source.number].at_points(b)

    def at_samples(self, b: Batch) -> Driven:
        """Where the force was recorded."""
        return self._along[b.source.number].at_samples(b)

    def along(self, source: Learned) -> Driven:
        """At all samples of a piece."""
        return self._along[source.number].samples


def effect_deviations(problem: Problem, unknowns: Array, covariance: Array) -> Array:
    """(P,) standard deviations [SI] of the effects' parameters, from a covariance (C, C)."""
    own = np.diag(covariance)[COMMON_COUNT : COMMON_COUNT + problem.effect_count]
    return np.sqrt(np.maximum(own, 0.0)) * problem.effect_slopes(problem.whole(unknowns))


def lateness(effects: Sequence[ActiveEffect]) -> float:
    """[s] by which effects make the force later than the motion as it was recorded."""
    signs = {"time_shift": 1.0, "displacement_shift": -1.0}
    return sum(signs.get(e.form.acts, 0.0) * e.values[0] for e in effects)


class _PieceTerms:
    """The effects along one piece: tables at its samples, and at these and half way between them."""

    def __init__(self, setting: Setting, source: Learned) -> None:
        self._setting, self._source = setting, source
        self._count = 1 + sum(len(e.values) for e in setting.effects)
        self._late = [1 + at for at, _, _ in setting.acting("time_shift")]
        self._early = [1 + at for at, _, _ in setting.acting("displacement_shift")]

    def at_samples(self, b: Batch) -> Driven:
        """Where the force was recorded; what is interpolated is nothing."""
        return self.samples.looked_up(lambda table: table[..., b.samples])

    def at_points(self, b: Batch) -> Driven:
        """Where the law is asked for."""
        place = np.clip(2.0 * b.time / b.source.inputs.h, 0.0, self._halves.field.u.shape[-1] - 1.001)
        i = place.astype(np.int64)
        t = place - i
        found = self._halves.looked_up(lambda table: (1.0 - t) * table[..., i] + t * table[..., i + 1])
        if not self._setting.acting("drive_delay", "field", "field_memory"):
            # In closed form, where it is known.
            found = found._replace(field=self._plain_field(b))
            found.over["u"][self._early] = found.field.over_delay
        values, over = self._straightened(*b.motion)
        return found._replace(values=found.values | values, over=found.over | over)

    def _plain_field(self, b: Batch) -> Field:
        early = sum(values[0] for _, _, values in self._setting.acting("displacement_shift"))
        return b.source.inputs.field(b.time, self._setting.coordinates.eta, self._setting.drive_delay + early)

    @cached_property
    def samples(self) -> Driven:
        """Inputs as they were when each sample's force acted."""
        setting, stroke = self._setting, self._source.piece.stroke
        motion = damper_motion(setting, stroke)
        field, scales = damper_field(setting, stroke), factors(setting, stroke, motion)
        moving = (0, *(1 + at for at in motion.columns))
        force, slopes = self._beside(motion, moving)
        values = {"x": motion.x, "beside": force}
        over = {
            "x": self._placed(moving, motion.dx),
            "beside": slopes,
            "u": self._placed((*(1 + at for at in field.columns), 0), field.du[2:]),
        }
        if scales.at.shape[1]:
            values["c1_factor"] = scales.at[2]
            over["c1_factor"] = self._placed((*moving, *(1 + at for at in scales.columns)), scales.over[:, 2])
        later = np.zeros(self._count)
        later[[0, *self._late]], later[self._early] = 1.0, -1.0
        return Driven(Field(field.u, *field.du[:2]), values, over, later)

    def _beside(self, motion: Motion, moving: tuple[int, ...]) -> tuple[Array, Array]:
        """Force [N] (N,) beside the law and in the channel, and its slopes (1 + P, N)."""
        setting, stroke = self._setting, self._source.piece.stroke
        h = 1.0 / stroke.rate
        over_motion, own = beside_slopes(setting, motion, h)
        J = self._placed(moving, over_motion)
        for at, row in own:
            J[1 + at] += row
        force = recorded(setting, stroke, motion, beside(setting, motion, h), J.T, 1, [0, *self._late])
        return force, J

    @cached_property
    def _halves(self) -> Driven:
        """Inputs on the displacement channel's own time, at the samples and half way between them."""
        stroke = self._source.piece.stroke
        setting = replace(self._setting, force_delay=-lateness(self._setting.effects))
        motion, field = damper_motion(setting, stroke), damper_field(setting, stroke)
        scales = factors(setting, stroke, motion)
        u, over_u = _interleaved(field.u, field.middle), _interleaved(field.du, field.dmiddle)
        over = {"u": self._placed(tuple(1 + at for at in field.columns), over_u[2:-1])}
        over["u"][self._early] = over_u[1]
        values = {}
        if scales.at.shape[1]:
            values = dict(zip(_FACTORS, _interleaved(scales.at, scales.middle), strict=True))
            columns = [1 + at for at in (*motion.columns, *scales.columns)]
            rows = self._placed(columns, _interleaved(scales.over, scales.over_middle)[1:].swapaxes(0, 1))
            # The motion of this time does not move with a shift of the channel.
            rows[:, self._early] = 0.0
            over |= dict(zip(_FACTORS, rows, strict=True))
        return Driven(Field(u, over_u[0], over_u[1]), values, over, np.zeros(self._count))

    def _straightened(self, x: Array, v: Array) -> tuple[dict[str, Array], Rows]:
        """Motion (K, M) behind a displacement channel that is bent, and its slopes."""
        bends = self._setting.acting("displacement_map")
        if not bends:
            return {}, {}
        effects = tuple(e for e in self._setting.effects if e.form.acts == "displacement_map")
        flat = Stroke(1.0, x.ravel(), v.ravel(), np.zeros(x.size), np.zeros(x.size))
        motion = damper_motion(Setting(self._setting.coordinates, effects=effects), flat)
        columns = [1 + at + k for at, _, values in bends for k in range(len(values))]
        values = {"x": motion.x.reshape(x.shape), "v": motion.v.reshape(x.shape)}
        over = {
            name: self._placed(columns, rows[1:]).reshape(self._count, *x.shape)
            for name, rows in (("x", motion.dx), ("v", motion.dv))
        }
        return values, over

    def _placed(self, columns: Sequence[int], rows: Array) -> Array:
        """Slopes (..., R, N) over some columns as slopes (..., 1 + P, N) over all; a late force is a delay."""
        table = np.zeros((*rows.shape[:-2], self._count, rows.shape[-1]))
        for column, k in zip(columns, range(rows.shape[-2]), strict=True):
            table[..., column, :] += rows[..., k, :]
        table[..., self._late, :] += table[..., :1, :]
        return table


def _interleaved(at: Array, middle: Array) -> Array:
    """Values (..., N) at the samples and (..., N - 1) half way between them, together (..., 2N - 1)."""
    found = np.empty((*at.shape[:-1], 2 * at.shape[-1] - 1))
    found[..., ::2], found[..., 1::2] = at, middle
    return found

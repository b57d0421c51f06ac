"""What is minimised: measured minus simulated force over all training samples, in units of the noise.

The unknowns are the search numbers, one inner displacement y(0) a stretch, and a small delay of the force and
of the drive channel against the displacement. Priors hold the delays, by what is known of the clocks, and y(0),
which cannot have been far outside the stroke: with a weak k0 it would else run off and carry a force offset.
Effects beside the law bring their parameters as further unknowns, behind all others; behind these stands what
each further log has of its own, where that is asked for.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array, BoolArray
from identification.condition import OWN, Condition
from identification.damper.coordinates import Coordinates
from identification.effect_choice import EffectChoice
from identification.piece import Piece
from identification.search_space import SearchSpace
from identification.simulate import UNKNOWNS, ActiveEffect, Setting

COORDINATE_COUNT = len(Coordinates._fields)
Y0_SCALE = 1e-3
"""[m] what a change of order one of a y(0) unknown means."""
_Y0_STROKES = 1.0
"""[1] standard deviation of y(0) about the middle of the motion, in half strokes."""
COMMON_COUNT = COORDINATE_COUNT + 2
"""Unknowns that come first and that all pieces share: the search numbers and the two delays."""
_AT_BOUND = 1e-9
"""[1] of a search number within which an unknown stands at a bound."""
_FAR = 10.0
"""[1] change of an effect's size, in its usual unit, that counts like one of a search number."""


@dataclass(frozen=True)
class Evaluation:
    """The cost at one point, and what a Gauss-Newton step needs."""

    cost: float
    """[1] sum of squared residuals in units of the noise, priors included."""
    hessian: Array
    """(U, U) J'J."""
    gradient: Array
    """(U,) J'r."""


@dataclass(frozen=True)
class Problem:
    """Pieces, noise and priors; the vector of unknowns is q (13), delays (2), y(0) of each piece, effects."""

    pieces: tuple[Piece, ...]
    space: SearchSpace
    noise: float
    """[N] standard deviation of the force noise."""
    delay_prior: float
    """[s] standard deviation of each delay beyond what is known."""
    effects: tuple[EffectChoice, ...] = ()
    """What is fitted along with the law."""
    own: tuple[str, ...] = ()
    """What each log behind the first has of its own, of ``OWN``."""
    delay_limit: float = np.inf
    """[1] of ``delay_prior`` beyond which no delay may go: what is later is for an effect to explain."""

    @property
    def samples(self) -> int:
        """Fitted samples."""
        return int(sum(p.train.sum() for p in self.pieces))

    @property
    def free(self) -> BoolArray:
        """(U,) True where an unknown is free."""
        # A drive that never changes shows no delay.
        delays = [True, not self.space.one_drive]
        rest = len(self.pieces) + self.effect_count + self.own_count
        return np.concatenate([self.space.free, delays, np.ones(rest, bool)])

    def inside(self, unknowns: Array) -> BoolArray:
        """(U,) True where an unknown is free and stands at none of its bounds."""
        low, high = self.bounds()
        return self.free & (unknowns > low + _AT_BOUND) & (unknowns < high - _AT_BOUND)

    @property
    def effect_count(self) -> int:
        """Parameters of the effects."""
        return sum(len(e.quantities) for e in self.effects)

    @property
    def own_count(self) -> int:
        """Unknowns that belong to one log each."""
        return len(self.own) * max((p.log for p in self.pieces), default=0)

    @property
    def first_own(self) -> int:
        """Place of the first unknown that belongs to one log."""
        return self.first_effect + self.effect_count

    @property
    def first_effect(self) -> int:
        """Place of the effects' first unknown."""
        return COMMON_COUNT + len(self.pieces)

    @property
    def shared(self) -> list[int]:
        """(C,) places of the unknowns that no piece has alone: q, the two delays, effects, each log's own."""
        return [*range(COMMON_COUNT), *range(self.first_effect, self.first_own + self.own_count)]

    @property
    def shared_priors(self) -> Array:
        """(C,) weights of the priors of these; all are centred on zero."""
        return self._priors()[1][self.shared]

    def whole(self, shared: Array) -> Array:
        """(U,) unknowns from the shared ones (C,); what a piece has alone stands at zero."""
        unknowns = np.zeros(self.first_own + self.own_count)
        unknowns[self.shared] = shared
        return unknowns

    def condition(self, shared: Array, piece: int) -> Condition:
        """What a piece's log has of its own at the shared unknowns (C,)."""
        return self.piece(self.whole(shared), piece).condition

    def own_slopes(self, unknowns: Array, piece: int) -> Array:
        """(13, O) change of a piece's coordinates over all that logs have of their own, before its ``chained``.

        ``unknowns`` may be all (U,) or the shared ones (C,): the coordinates come first in both.
        """
        found = np.zeros((COORDINATE_COUNT, self.own_count))
        coordinates = self.space.to_coordinates(unknowns[:COORDINATE_COUNT])
        for name, place in zip(self.own, self._own_places(self.pieces[piece]), strict=False):
            found[:, place - self.first_own] = OWN[name].slopes(coordinates)
        return found

    @property
    def delays(self) -> BoolArray:
        """(U,) True for the two delays."""
        mask = np.zeros(self.first_own + self.own_count, bool)
        mask[COORDINATE_COUNT:COMMON_COUNT] = True
        return mask

    def bounds(self) -> tuple[Array, Array]:
        """Lowest and highest unknowns, (U,) each."""
        low, high = self.space.bounds()
        rest = np.concatenate([np.full(2, self.delay_limit), np.full(len(self.pieces), np.inf)])
        own = [e.bounds() for e in self.effects]
        lows, highs = [b[0] for b in own], [b[1] for b in own]
        wide = np.full(self.own_count, np.inf)
        return np.concatenate([low, -rest, *lows, -wide]), np.concatenate([high, rest, *highs, wide])

    def start(self, coordinates: Coordinates) -> Array:
        """(U,) unknowns at a point, delays as known, y(0) where the inner displacement would come to rest."""
        y0 = [p.stroke.displacement.mean() / Y0_SCALE for p in self.pieces]
        own = [e.to_search(e.form.starts[0]) for e in self.effects]
        alike = np.zeros(self.own_count)
        return np.concatenate([self.space.to_search(coordinates), np.zeros(2), y0, *own, alike])

    def step_length(self, step: Array) -> float:
        """Largest change in a step (U,), in units of a search number; delays and y(0) do not count."""
        own = np.abs(step[self.first_effect : self.first_own])
        if not len(own):
            return float(np.abs(step[:COORDINATE_COUNT]).max())
        logarithmic = np.concatenate([e.logarithmic for e in self.effects])
        sizes = np.where(logarithmic, own, own / _FAR)
        return float(max(np.abs(step[:COORDINATE_COUNT]).max(), sizes.max()))

    def further_delays(self, unknowns: Array) -> tuple[float, float]:
        """[s] of the force and of the drive channel beyond what is known, at all unknowns or the shared ones."""
        force, drive = unknowns[COORDINATE_COUNT:COMMON_COUNT] * self.delay_prior
        return float(force), float(drive)

    def active_effects(self, unknowns: Array) -> tuple[ActiveEffect, ...]:
        """The effects with their values."""
        return tuple(e.active(unknowns[own]) for e, own in self.effect_places())

    def effect_slopes(self, unknowns: Array) -> Array:
        """(P,) slopes of the effects' parameters over their search numbers."""
        return np.concatenate([np.empty(0), *(e.slopes(unknowns[own]) for e, own in self.effect_places())])

    def effect_places(self) -> Iterator[tuple[EffectChoice, slice]]:
        """The effects with the places of their unknowns."""
        at = self.first_effect
        for effect in self.effects:
            yield effect, slice(at, at + len(effect.quantities))
            at += len(effect.quantities)

    def setting(self, unknowns: Array, piece: int) -> Setting:
        """What a piece is simulated with."""
        p = self.pieces[piece]
        force_delay, drive_delay = self.further_delays(unknowns)
        return Setting(
            self.space.to_coordinates(unknowns[:COORDINATE_COUNT]),
            y0=float(unknowns[COMMON_COUNT + piece]) * Y0_SCALE,
            force_delay=p.force_delay + force_delay,
            drive_delay=p.drive_delay + drive_delay,
            effects=self.active_effects(unknowns),
        )

    def simulate(self, unknowns: Array) -> list[Array]:
        """The force [N] of every piece as it would be recorded, (N,) each."""
        return [self.piece(unknowns, i).recorded(self.setting(unknowns, i))[0] for i in range(len(self.pieces))]

    def piece(self, unknowns: Array, piece: int) -> Piece:
        """A piece under the condition of its log at a point."""
        p = self.pieces[piece]
        places = self._own_places(p)
        if not places:
            return p
        return replace(p, condition=Condition.at(dict(zip(self.own, unknowns[places], strict=True))))

    def _own_places(self, piece: Piece) -> list[int]:
        """Places of the unknowns that belong to a piece's log."""
        first = self.first_own + (piece.log - 1) * len(self.own)
        return list(range(first, first + len(self.own))) if self.own and piece.log > 0 else []

    def columns(self, piece: int) -> list[int]:
        """Places of the unknowns that a piece depends on: q, the two delays, its own y(0), effects, its log's."""
        effects = range(self.first_effect, self.first_effect + self.effect_count)
        return [*range(COMMON_COUNT), COMMON_COUNT + piece, *effects, *self._own_places(self.pieces[piece])]

    def residuals(self, unknowns: Array, piece: int) -> tuple[Array, Array]:
        """Residuals (N,) of a piece and their slopes (N, 16 + P) over its ``columns``; zero where not fitted."""
        weight, r, J = self._raw(unknowns, piece)
        return r * weight, (J * weight[:, None]) @ self._scales(unknowns, piece)

    def evaluate(self, unknowns: Array) -> Evaluation:
        """Cost, J'J and J'r at a point; an unstable point costs infinity."""
        centre, weight = self._priors()
        pulled = weight * (unknowns - centre)
        hessian, gradient, cost = np.diag(weight**2), weight * pulled, float(pulled @ pulled)
        for i in range(len(self.pieces)):
            # The chain rule acts on the small product, not on every row. Search numbers are scaled well enough for
            # normal equations (condition 7.5, decision 0002).
            D = self._scales(unknowns, i)
            weight, r, J = self._raw(unknowns, i)
            columns = self.columns(i)
            with np.errstate(over="ignore", invalid="ignore"):  # of an unstable point
                J *= weight[:, None]
                r *= weight
                hessian[np.ix_(columns, columns)] += D.T @ (J.T @ J) @ D
                gradient[columns] += D.T @ (J.T @ r)
                cost += float(r @ r)
        return Evaluation(cost if np.isfinite(cost) else np.inf, hessian, gradient)

    def cost(self, unknowns: Array) -> float:
        """The cost alone; an unstable point costs infinity."""
        centre, weight = self._priors()
        total = float(np.sum((weight * (unknowns - centre)) ** 2))
        for force, p in zip(self.simulate(unknowns), self.pieces, strict=True):
            total += float(np.sum((p.train / self.noise * (force - p.force)) ** 2))
        return total if np.isfinite(total) else np.inf

    def _priors(self) -> tuple[Array, Array]:
        """Centre and weight (U,) of the priors; a weight of zero holds nothing."""
        stroke = max(float(np.ptp(p.stroke.displacement)) for p in self.pieces) / 2.0
        means = np.array([p.stroke.displacement.mean() for p in self.pieces])
        rest, own = np.zeros(COORDINATE_COUNT), np.zeros(self.effect_count)
        centre = np.concatenate([rest, [0.0, 0.0], means / Y0_SCALE, own])
        held = np.full(len(means), Y0_SCALE / (_Y0_STROKES * stroke))
        alike = np.zeros(self.own_count)
        return np.concatenate([centre, alike]), np.concatenate([rest, [1.0, 1.0], held, own, alike + 1.0])

    def _raw(self, unknowns: Array, piece: int) -> tuple[Array, Array, Array]:
        """Weights [1/N], force errors [N] and their slopes (N, 16 + P) over what ``UNKNOWNS`` says and effects."""
        p = self.piece(unknowns, piece)
        force, slopes = p.recorded(self.setting(unknowns, piece), slopes=True)
        return p.train / self.noise, force - p.force, slopes

    def _scales(self, unknowns: Array, piece: int) -> Array:
        """(16 + P, columns) derivative of coordinates, y(0), delays and effects over a piece's unknowns."""
        D = np.zeros((len(UNKNOWNS) + self.effect_count, len(self.columns(piece))))
        D[:COORDINATE_COUNT, :COORDINATE_COUNT] = self.space.slopes(unknowns[:COORDINATE_COUNT])
        D[UNKNOWNS.index("force_delay"), COORDINATE_COUNT] = self.delay_prior
        D[UNKNOWNS.index("drive_delay"), COORDINATE_COUNT + 1] = self.delay_prior
        D[UNKNOWNS.index("y0"), COMMON_COUNT] = Y0_SCALE
        behind = COMMON_COUNT + 1 + self.effect_count
        D[len(UNKNOWNS) :, COMMON_COUNT + 1 : behind] = np.diag(self.effect_slopes(unknowns))
        if places := self._own_places(self.pieces[piece]):
            own = [place - self.first_own for place in places]
            D[:COORDINATE_COUNT, behind:] = self.own_slopes(unknowns, piece)[:, own]
        return D

    def quicker(self) -> "Problem":
        """The same problem with quicker pieces, for the way to the minimum but not for its end."""
        return replace(self, pieces=tuple(p.quicker() for p in self.pieces))

    def coarser(self, times: int) -> "Problem":
        """The same problem on every so many samples, for a first look; of slower recordings fewer are left out."""
        highest = max(p.stroke.rate for p in self.pieces)
        each = [max(1, round(times * p.stroke.rate / highest)) for p in self.pieces]
        pieces = (p.coarser(k) if k > 1 else p for p, k in zip(self.pieces, each, strict=True))
        return replace(self, pieces=tuple(pieces))

    def with_effects(self, effects: tuple[EffectChoice, ...]) -> "Problem":
        """The same problem with other effects beside the law."""
        return replace(self, effects=effects)

    def without(self, aside: Sequence[Array]) -> "Problem":
        """The same problem with further samples set aside; one mask (N,) a piece, of samples fitted now."""
        return self.with_training([p.train - mask for p, mask in zip(self.pieces, aside, strict=True)])

    def with_training(self, train: Sequence[Array]) -> "Problem":
        """The same problem with other samples fitted; one mask (N,) a piece."""
        pieces = tuple(replace(p, train=t) for p, t in zip(self.pieces, train, strict=True))
        return replace(self, pieces=pieces)

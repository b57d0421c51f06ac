"""Least-squares problem of a fit: simulated less recorded force over all fitted samples, in units of the noise.

Priors constrain the delays, by the accuracy of the clocks, and y(0), which cannot have been far outside the
stroke. Without its prior and with a weak k0, y(0) would diverge and absorb a force offset. `unknown_layout` states
the order of the unknowns.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from identification.arrays import Array, BoolArray
from identification.damper import Coordinates
from identification.fitting.effect_model import EffectModel
from identification.fitting.log_correction import PER_LOG_PARAMETERS, LogCorrection
from identification.fitting.piece import Piece
from identification.fitting.search_space import SearchSpace
from identification.fitting.unknown_layout import COMMON_COUNT, COORDINATE_COUNT, UnknownLayout
from identification.simulate import SENSITIVITY_COLUMNS, ActiveEffect, SimulationModel

_Y0_PRIOR = 1.0
"""Standard deviation of y(0) about the middle of the motion, in units of the length."""
_BOUND_TOLERANCE = 1e-9
"""Distance from a bound, in search coordinates, within which an unknown is at it."""
_EFFECT_STEP_SCALE = 10.0
"""Change of an effect's size, over its scale, that counts as much as one of a search coordinate."""
DELAY_LIMIT = 3.0
"""Largest channel delay in standard deviations of its prior (dimensionless); a larger one is an effect."""


@dataclass(frozen=True)
class Evaluation:
    """Cost at one point, with its Gauss-Newton approximation."""

    cost: float
    """Sum of squared residuals in units of the noise, priors included (dimensionless)."""
    hessian: Array
    """(U, U) J'J."""
    gradient: Array
    """(U,) J'r."""


@dataclass(frozen=True)
class Problem:
    """Pieces, noise, priors and effects of a fit."""

    pieces: tuple[Piece, ...]
    space: SearchSpace
    noise: float
    """Standard deviation of the force noise [N]."""
    delay_prior: float
    """Standard deviation of each residual delay [s]."""
    effects: tuple[EffectModel, ...] = ()
    """Effects fitted together with the law."""
    per_log: tuple[str, ...] = ()
    """Per-log parameters of each log after the first, of `PER_LOG_PARAMETERS`."""
    delay_limit: float = np.inf
    """Largest residual delay over ``delay_prior``; a larger delay is for an effect to explain."""

    @cached_property
    def layout(self) -> UnknownLayout:
        """Order of the unknowns."""
        further_logs = max((p.log for p in self.pieces), default=0)
        sizes = tuple(len(e.quantities) for e in self.effects)
        return UnknownLayout(len(self.pieces), sizes, len(self.per_log), further_logs)

    @property
    def samples(self) -> int:
        """Number of fitted samples."""
        return int(sum(p.train.sum() for p in self.pieces))

    @property
    def y0_scale(self) -> float:
        """Inner displacement of one unit of a y(0) unknown [m]."""
        return self.space.scales.length

    @property
    def free_mask(self) -> BoolArray:
        """(U,) True where an unknown is free."""
        mask = np.ones(self.layout.size, bool)
        mask[self.layout.coordinates] = self.space.free_mask
        # A drive that never changes does not show its delay.
        mask[COMMON_COUNT - 1] = not self.space.has_one_drive
        return mask

    @property
    def delay_mask(self) -> BoolArray:
        """(U,) True for the two delays."""
        mask = np.zeros(self.layout.size, bool)
        mask[self.layout.delays] = True
        return mask

    def find_interior(self, unknowns: Array) -> BoolArray:
        """Return a mask (U,) of unknowns that are free and not at a bound."""
        low, high = self.get_bounds()
        return self.free_mask & (unknowns > low + _BOUND_TOLERANCE) & (unknowns < high - _BOUND_TOLERANCE)

    def get_bounds(self) -> tuple[Array, Array]:
        """Return lowest and highest unknowns, (U,) each."""
        high = np.full(self.layout.size, np.inf)
        low = -high
        low[self.layout.coordinates], high[self.layout.coordinates] = self.space.get_bounds()
        low[self.layout.delays], high[self.layout.delays] = -self.delay_limit, self.delay_limit
        for effect, columns in self.iterate_effects():
            low[columns], high[columns] = effect.get_bounds()
        return low, high

    def make_start(self, coordinates: Coordinates) -> Array:
        """Return unknowns (U,) at coordinates, with y(0) in the middle of the motion and effects at a start."""
        unknowns = np.zeros(self.layout.size)
        unknowns[self.layout.coordinates] = self.space.to_search(coordinates)
        unknowns[self.layout.y0] = [p.excitation.displacement.mean() / self.y0_scale for p in self.pieces]
        for effect, columns in self.iterate_effects():
            unknowns[columns] = effect.to_search(effect.starts[0])
        return unknowns

    def measure_step(self, step: Array) -> float:
        """Return the largest change in a step (U,), in search coordinates; delays and y(0) do not count."""
        changes = [np.abs(step[self.layout.coordinates]).max()]
        for effect, columns in self.iterate_effects():
            sizes = np.abs(step[columns])
            changes.append(np.where(effect.log_mask, sizes, sizes / _EFFECT_STEP_SCALE).max())
        return float(max(changes))

    def iterate_effects(self) -> Iterator[tuple[EffectModel, slice]]:
        """Yield each effect with the slice of its unknowns."""
        return zip(self.effects, self.layout.effect_slices, strict=True)

    def compute_residual_delays(self, unknowns: Array) -> tuple[float, float]:
        """Return the residual delays [s] of force and drive channel, at all unknowns or the shared ones."""
        force, drive = unknowns[self.layout.delays] * self.delay_prior
        return float(force), float(drive)

    def make_active_effects(self, unknowns: Array) -> tuple[ActiveEffect, ...]:
        """Return the effects with their values."""
        return tuple(e.make_active_effect(unknowns[columns]) for e, columns in self.iterate_effects())

    def differentiate_effects(self, unknowns: Array) -> Array:
        """Return the derivatives (P,) of the effects' parameters over their search coordinates."""
        return np.concatenate(
            [np.empty(0), *(e.differentiate(unknowns[columns]) for e, columns in self.iterate_effects())]
        )

    @property
    def shared_columns(self) -> list[int]:
        """(C,) indices of the unknowns that no piece has alone."""
        return self.layout.shared_columns

    @property
    def shared_prior_weights(self) -> Array:
        """(C,) weights of the priors of the shared unknowns, which are all centred on zero."""
        return self._compute_priors()[1][self.shared_columns]

    def expand_shared(self, shared: Array) -> Array:
        """Return unknowns (U,) from the shared ones (C,), with y(0) at zero."""
        unknowns = np.zeros(self.layout.size)
        unknowns[self.shared_columns] = shared
        return unknowns

    def find_correction(self, shared: Array, piece: int) -> LogCorrection:
        """Return the correction of a piece's log at the shared unknowns (C,)."""
        return self.get_piece(self.expand_shared(shared), piece).correction

    def differentiate_per_log(self, unknowns: Array, piece: int) -> Array:
        """Return the derivatives (13, O) of a piece's coordinates over all per-log parameters.

        They precede the chain rule of `LogCorrection`. ``unknowns`` may be all (U,) or the shared ones (C,),
        because the coordinates come first in both.
        """
        derivatives = np.zeros((COORDINATE_COUNT, self.layout.per_log_count))
        coordinates = self.space.to_coordinates(unknowns[self.layout.coordinates])
        first = self.layout.per_log.start
        for name, column in zip(self.per_log, self._find_log_columns(piece), strict=False):
            derivatives[:, column - first] = PER_LOG_PARAMETERS[name].differentiate(coordinates)
        return derivatives

    def get_piece(self, unknowns: Array, piece: int) -> Piece:
        """Return a piece with the correction of its log."""
        columns = self._find_log_columns(piece)
        if not columns:
            return self.pieces[piece]
        parameters = dict(zip(self.per_log, unknowns[columns], strict=True))
        return replace(self.pieces[piece], correction=LogCorrection.from_unknowns(parameters))

    def _find_log_columns(self, piece: int) -> list[int]:
        return self.layout.find_log_columns(self.pieces[piece].log)

    def find_columns(self, piece: int) -> list[int]:
        """Return the indices of the unknowns that a piece depends on."""
        return self.layout.find_piece_columns(piece, self.pieces[piece].log)

    def make_model(self, unknowns: Array, piece: int) -> SimulationModel:
        """Return the simulation model of a piece."""
        p = self.pieces[piece]
        force_delay, drive_delay = self.compute_residual_delays(unknowns)
        return SimulationModel(
            self.space.to_coordinates(unknowns[self.layout.coordinates]),
            y0=float(unknowns[self.layout.y0][piece]) * self.y0_scale,
            force_delay=p.force_delay + force_delay,
            drive_delay=p.drive_delay + drive_delay,
            effects=self.make_active_effects(unknowns),
        )

    def simulate(self, unknowns: Array) -> list[Array]:
        """Return the simulated force [N] of every piece as its channel would record it, (N,) each."""
        return [
            self.get_piece(unknowns, i).simulate(self.make_model(unknowns, i))[0] for i in range(len(self.pieces))
        ]

    def compute_residuals(self, unknowns: Array, piece: int) -> tuple[Array, Array]:
        """Return residuals (N,) of a piece and their derivatives over its columns; zero where not fitted."""
        weight, r, J = self._compute_errors(unknowns, piece)
        J *= weight[:, None]
        return r * weight, J @ self._differentiate_unknowns(unknowns, piece)

    def evaluate(self, unknowns: Array) -> Evaluation:
        """Return cost, J'J and J'r; an unstable point has infinite cost."""
        centre, weight = self._compute_priors()
        deviation = weight * (unknowns - centre)
        hessian, gradient, cost = np.diag(weight**2), weight * deviation, float(deviation @ deviation)
        for i in range(len(self.pieces)):
            # The chain rule acts on the small product, not on every row. Search coordinates are scaled well enough
            # for normal equations (condition 7.5, decision 0002).
            D = self._differentiate_unknowns(unknowns, i)
            weight, r, J = self._compute_errors(unknowns, i)
            columns = self.find_columns(i)
            with np.errstate(over="ignore", invalid="ignore"):  # of an unstable point
                J *= weight[:, None]
                r *= weight
                hessian[np.ix_(columns, columns)] += D.T @ (J.T @ J) @ D
                gradient[columns] += D.T @ (J.T @ r)
                cost += float(r @ r)
        return Evaluation(cost if np.isfinite(cost) else np.inf, hessian, gradient)

    def compute_cost(self, unknowns: Array) -> float:
        """Return the cost alone; an unstable point has infinite cost."""
        centre, weight = self._compute_priors()
        total = float(np.sum((weight * (unknowns - centre)) ** 2))
        with np.errstate(over="ignore", invalid="ignore"):  # of an unstable point
            for force, p in zip(self.simulate(unknowns), self.pieces, strict=True):
                total += float(np.sum((p.train / self.noise * (force - p.force)) ** 2))
        return total if np.isfinite(total) else np.inf

    def _compute_priors(self) -> tuple[Array, Array]:
        """Return centre and weight (U,) of the priors; a weight of zero means none."""
        means = np.array([p.excitation.displacement.mean() for p in self.pieces])
        centre, weight = np.zeros(self.layout.size), np.zeros(self.layout.size)
        weight[self.layout.delays] = 1.0
        centre[self.layout.y0] = means / self.y0_scale
        weight[self.layout.y0] = 1.0 / _Y0_PRIOR
        weight[self.layout.per_log] = 1.0
        for effect, columns in self.iterate_effects():
            if effect.prior_deviations:
                weight[columns] = 1.0 / np.array(effect.prior_deviations)
        return centre, weight

    def _compute_errors(self, unknowns: Array, piece: int) -> tuple[Array, Array, Array]:
        """Return weights [1/N], force errors [N] and their sensitivities (N, 16 + P), effects after the others."""
        p = self.get_piece(unknowns, piece)
        force, sensitivities = p.simulate(self.make_model(unknowns, piece), sensitivities=True)
        return p.train / self.noise, force - p.force, sensitivities

    def _differentiate_unknowns(self, unknowns: Array, piece: int) -> Array:
        """Return the derivatives (16 + P, columns) of the sensitivities' columns over a piece's unknowns."""
        layout, effects = self.layout, slice(COMMON_COUNT + 1, COMMON_COUNT + 1 + self.layout.effect_count)
        D = np.zeros((len(SENSITIVITY_COLUMNS) + layout.effect_count, len(self.find_columns(piece))))
        D[layout.coordinates, layout.coordinates] = self.space.differentiate(unknowns[layout.coordinates])
        D[SENSITIVITY_COLUMNS.index("force_delay"), COORDINATE_COUNT] = self.delay_prior
        D[SENSITIVITY_COLUMNS.index("drive_delay"), COORDINATE_COUNT + 1] = self.delay_prior
        D[SENSITIVITY_COLUMNS.index("y0"), COMMON_COUNT] = self.y0_scale
        D[len(SENSITIVITY_COLUMNS) :, effects] = np.diag(self.differentiate_effects(unknowns))
        if columns := self._find_log_columns(piece):
            log_columns = [column - layout.per_log.start for column in columns]
            D[layout.coordinates, effects.stop :] = self.differentiate_per_log(unknowns, piece)[:, log_columns]
        return D

    def make_fast(self) -> "Problem":
        """Return the fast variant of the problem, for the search but not for its end."""
        return replace(self, pieces=tuple(p.make_fast() for p in self.pieces))

    def decimate(self, factor: int) -> "Problem":
        """Return the problem on every n-th sample, fewer samples being dropped from slower recordings."""
        highest = max(p.excitation.rate for p in self.pieces)
        factors = [max(1, round(factor * p.excitation.rate / highest)) for p in self.pieces]
        pieces = (p.decimate(k) if k > 1 else p for p, k in zip(self.pieces, factors, strict=True))
        return replace(self, pieces=tuple(pieces))

    def replace_effects(self, effects: tuple[EffectModel, ...]) -> "Problem":
        """Return the problem with other effects."""
        return replace(self, effects=effects)

    def exclude_samples(self, masks: Sequence[Array]) -> "Problem":
        """Return the problem without some fitted samples; one mask (N,) a piece."""
        return self.replace_training([p.train - mask for p, mask in zip(self.pieces, masks, strict=True)])

    def replace_training(self, train: Sequence[Array]) -> "Problem":
        """Return the problem with other fitted samples; one mask (N,) a piece."""
        pieces = tuple(replace(p, train=t) for p, t in zip(self.pieces, train, strict=True))
        return replace(self, pieces=pieces)

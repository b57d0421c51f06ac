"""Training of the local network: levels of rising physics weight, elements placed anew, multipliers at the end."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from identification.arrays import Array, BoolArray
from identification.damper.coordinates import Coordinates
from identification.force_channel import filter_lag
from identification.piece import Piece
from identification.pinn.batches import Learned, learned, make_batches
from identification.pinn.beginning import FirstStates, Start
from identification.pinn.effect_terms import Acting, lateness
from identification.pinn.elimination import Factorised, NodePrior, factorise
from identification.pinn.hidden_layer import HiddenLayer
from identification.pinn.local_rows import LocalLoss, Rows, Weights
from identification.pinn.mesh import Y_UNIT, Heads, LocalNetwork, SlipVelocity, States, make_mesh
from identification.pinn.quadrature import gauss_points
from identification.pinn.result import Moment
from identification.pinn.settings import Level, LocalSettings
from identification.pinn.supervision import Supervision
from identification.problem import COMMON_COUNT, COORDINATE_COUNT, Problem

_LARGEST_STEP = 0.7
"""[1] largest change of a search number in one step."""
_SHORTER, _TRIES = 0.4, 8
_SMALL = 1e-5
"""[1] relative fall of the cost below which a mesh is finished."""
_DAMPING, _DAMPING_LATER = 1e-3, 1e-5
"""[1] per sample, on the shared unknowns: while the network is still wrong, and from then on."""
_FINE = 1e-3
"""[s] between points of the slip velocity, at most."""
_SAME = 0.3
"""[1] deviations by which the shared unknowns move on a new mesh, below which another one brings nothing."""
_WAITING, _WAITING_AGAIN = 3, 1
"""Steps of the multipliers for which the shared unknowns wait, before they move at all and later on."""
_FINISHING, _FINISHING_ANEW = 2, 4
"""Most meshes of the last descent, which begins close to its end; where the states begin anew."""


class Misfit(NamedTuple):
    """How well the network does, without weights."""

    force: float
    """[N] root mean square over the fitted samples."""
    hysteresis: float
    """[1] of the slip velocity at breakthrough."""
    balance: float
    """[N]"""
    unresolved: float
    """[1] of the slip velocity at breakthrough: the part of the stroke's own velocity that is too rough for the
    functions of an element. The law cannot be kept better than this."""


@dataclass(frozen=True)
class Trained:
    """A network, its parameters and how sure they are."""

    unknowns: Array
    """(C,) search numbers, delays, effects, what logs have of their own: all that no piece has alone."""
    network: LocalNetwork
    information: Array
    """(C, C) of the last factorisation, in units of the noise it was weighed with."""
    misfit: Misfit
    steps: int

    def covariance(self, problem: Problem) -> Array:
        """(C, C) of the shared unknowns; zero rows where one is not free."""
        free = problem.free[problem.shared]
        found = np.zeros((len(free), len(free)))
        found[np.ix_(free, free)] = np.linalg.pinv(self.information[np.ix_(free, free)], rcond=1e-13)
        return found


class LocalTraining:
    """A network in training on one problem."""

    def __init__(self, problem: Problem, settings: LocalSettings, supervision: Supervision, start: Start) -> None:
        self.problem, self.settings, self.supervision = problem, settings, supervision
        self.unknowns = np.concatenate(
            [problem.space.to_search(start.coordinates), np.zeros(2), start.effects, np.zeros(problem.own_count)]
        )
        self.noise = max(problem.noise, start.misfit)
        self.steps = 0
        self.history: list[Moment] = []
        self.phase = ""
        self.size = settings.layers[0]
        self.network = self._first(problem)
        self.misfit = Misfit(np.inf, np.inf, np.inf, 0.0)
        self.information = np.zeros((len(self.unknowns), len(self.unknowns)))

    def _first(self, problem: Problem) -> LocalNetwork:
        """States as the recorded force shows them to a damper with the present coordinates."""
        c = problem.space.to_coordinates(self.unknowns[:COORDINATE_COUNT])
        pieces = learned(coarse(problem))
        acting = Acting(problem, pieces, self.unknowns) if problem.effects else None
        first = [
            FirstStates(
                p,
                problem.condition(self.unknowns, p.number).of(c),
                acting.along(p).values["beside"] if acting else 0.0,
            )
            for p in pieces
        ]
        slips = [f.slip_velocity() for f in first]
        return self._on_mesh(pieces, slips, None, self._layer(), lambda i, t: first[i].at(t))

    def run(self) -> Trained:
        """All levels, one after the other."""
        for number, level in enumerate(self.settings.levels):
            self._level(number, level, coarse(self.problem))
        return self._trained()

    def finish(self, problem: Problem, *, longer: bool = False) -> Trained:
        """The last level once more, with other samples or motion, and the law as a constraint.

        Args:
            problem: with other samples or motion.
            longer: it reaches beyond what was learned so far, so that the states begin anew.
        """
        self.problem = problem
        if longer:
            self.network = self._first(problem)
        number = len(self.settings.levels) - 1
        meshes = _FINISHING_ANEW if longer else _FINISHING
        last = self.settings.levels[number].model_copy(update={"thin": 1, "meshes": meshes})
        self._level(number, last, problem)
        self._multiply(last.physics)
        for size in self.settings.layers[1:]:
            if self.misfit.hysteresis <= np.hypot(self.settings.kept, self.misfit.unresolved):
                break
            self.size = size
            self.network = self._on_same_mesh(self._layer())
            self._level(number, last, problem)
            self._multiply(last.physics)
        return self._trained()

    def _layer(self) -> HiddenLayer:
        return HiddenLayer(self.size.units, self.size.rank, self.settings.seed, self.settings.activation)

    def _on_same_mesh(self, layer: HiddenLayer) -> LocalNetwork:
        """The same states on another hidden layer."""
        network = replace(self.network, layer=layer)
        return network.fitted(self.network.mesh, self.network.at, gauss_points(self.size.points)[0])

    def _trained(self) -> Trained:
        return Trained(self.unknowns, self.network, self.information, self.misfit, self.steps)

    def _level(self, number: int, level: Level, problem: Problem) -> None:
        """Train with one weight of the law until the elements stay where they are."""
        self.phase = f"law weighed {level.physics:g}"
        pieces = learned(problem, thin=level.thin)
        for again in range(level.meshes):
            moved, before = self._remesh(pieces), self.unknowns
            loss = self._loss(problem, pieces)
            damping = _DAMPING if number == 0 and again < 2 else _DAMPING_LATER
            free = self._free(level, number, again)
            self._descend(loss, Weights(level.physics, self.noise), free, level.steps, damping * problem.samples)
            # What the law cannot follow counts as noise, or the network would follow it at the law's expense.
            self.noise = max(problem.noise, self.misfit.force)
            if (again or number) and (moved < level.settled or self._unchanged(before)):
                break

    def _unchanged(self, before: Array) -> bool:
        """Whether a new mesh brought nothing: a reversal may waver where the slip creeps, and nothing follows."""
        way = self.unknowns - before
        moved = float(way @ self.information @ way)
        return moved < _SAME**2

    def _multiply(self, physics: float) -> None:
        """The law as a constraint: residuals that stay are added to what is asked for (multipliers).

        The shared unknowns wait until the states keep the law. Moving at once, they would slide along what its
        finite weight still allows, and where the strokes hardly show the shape of the loop they would not return.
        """
        self.phase = "multipliers"
        pieces = learned(self.problem)
        loss, weights = self._loss(self.problem, pieces), Weights(physics, self.noise)
        free = self._free(self.settings.levels[-1], 1, 1)
        pull = None
        for number in range(self.settings.multipliers):
            for _ in range(_WAITING_AGAIN if number else _WAITING):
                pull = loss.rows(self.unknowns, self.network.heads, weights, pull, slopes=False)
                self._descend(loss, weights, np.zeros(len(self.unknowns), bool), 2, 0.0, pull)
            self._descend(loss, weights, free, 4, 0.0, pull)
        self.information = self._factorised(loss, weights, pull)[0].information()

    def _free(self, level: Level, number: int, again: int) -> BoolArray:
        """(C,) which shared unknowns may move."""
        free = self.problem.free[self.problem.shared]
        first = number == 0 and again == 0
        held = [name in level.held or (name == "eta" and first) for name in Coordinates._fields]
        free[:COORDINATE_COUNT] &= ~np.array(held)
        free[COORDINATE_COUNT:COMMON_COUNT] &= number > 0
        free[COMMON_COUNT:] &= not first
        return free

    def _descend(
        self, loss: LocalLoss, weights: Weights, free: BoolArray, steps: int, damping: float,
        pull: Sequence[Rows] | None = None,
    ) -> None:  # fmt: skip
        """Gauss-Newton on heads and shared unknowns together."""
        for _ in range(steps):
            factorised, cost = self._factorised(loss, weights, pull)
            low, high = (bound[self.problem.shared] - self.unknowns for bound in self.problem.bounds())
            step = factorised.step(free, np.full(len(free), damping), low, high)
            heads = factorised.heads(step, self.network.mesh, loss.batches)
            fall = self._along(loss, weights, pull, step, heads, cost)
            self.steps += 1
            self.supervision.step(f"pinn, {self.phase}", self.misfit.force)
            if fall < _SMALL * cost:
                break
        self.information = factorised.information()
        self.misfit = _misfit(loss, self.unknowns, self.network.heads)
        self.history.append(Moment(self.supervision.seconds, self.phase, *self.misfit[:3]))

    def _factorised(
        self, loss: LocalLoss, weights: Weights, pull: Sequence[Rows] | None
    ) -> tuple[Factorised, float]:
        rows = loss.rows(self.unknowns, self.network.heads, weights, pull, slopes=True)
        priors = [_node_prior(p) for p in loss.problem.pieces]
        found = factorise(rows, loss.batches, self.network.mesh, self.network.heads, priors)
        return self._with_priors(found), self._cost(rows, self.unknowns)

    def _with_priors(self, found: Factorised) -> Factorised:
        """With what is known of the shared unknowns beforehand."""
        held = self.problem.shared_priors
        table = np.column_stack([np.diag(held), -held * self.unknowns])[held > 0.0]
        return replace(found, triangle=np.vstack([found.triangle, table]))

    def _cost(self, rows: Sequence[Rows], unknowns: Array) -> float:
        """[1] of all rows and of the priors."""
        pulled = self.problem.shared_priors * unknowns
        total = sum(float((row.all**2).sum()) for row in rows) + float(pulled @ pulled)
        return total if np.isfinite(total) else np.inf

    def _along(
        self,
        loss: LocalLoss,
        weights: Weights,
        pull: Sequence[Rows] | None,
        step: Array,
        heads: Heads,
        cost: float,
    ) -> float:
        """As far along a step as the cost falls; how far it fell."""
        share = min(1.0, _LARGEST_STEP / max(self._length(step), 1e-12))
        for _ in range(_TRIES):
            unknowns = self.unknowns + share * step
            moved = self.network.heads.moved(heads, share)
            there = self._cost(loss.rows(unknowns, moved, weights, pull, slopes=False), unknowns)
            if there < cost:
                self.unknowns, self.network = unknowns, replace(self.network, heads=moved)
                return cost - there
            share *= _SHORTER
        return 0.0

    def _length(self, step: Array) -> float:
        """Of a step of the shared unknowns (C,), in units of a search number."""
        return self.problem.step_length(self.problem.whole(step))

    def _loss(self, problem: Problem, pieces: Sequence[Learned]) -> LocalLoss:
        delay, _ = problem.further_delays(self.unknowns)
        delay += lateness(problem.active_effects(problem.whole(self.unknowns)))
        batches = make_batches(pieces, self.network, delay, self.size.points, self.settings.residual)
        return LocalLoss(problem, batches, delay)

    def _remesh(self, pieces: Sequence[Learned]) -> float:
        """Place the elements anew by the network's own slip; the largest shift of a reversal [s]."""
        before, slips = self.network, [self._slip(i, p) for i, p in enumerate(pieces)]
        self.network = self._on_mesh(pieces, slips, before, before.layer, before.at)
        return self.network.mesh.moved(before.mesh)

    def _slip(self, number: int, source: Learned) -> SlipVelocity:
        """The network's own, seen at each sample: finer would cost much and move no reversal."""
        if self.settings.features == "stroke":
            return lambda time: source.inputs.motion(time)[1]
        grid = np.arange(source.span.start, source.span.end + source.inputs.h, min(source.inputs.h, _FINE))
        slip = source.inputs.motion(grid)[1] - self.network.inner_velocity(number, grid)
        return lambda time: np.interp(time, grid, slip)

    def _on_mesh(
        self, pieces: Sequence[Learned], slips: Sequence[SlipVelocity], before: LocalNetwork | None,
        layer: HiddenLayer, states: Callable[[int, Array], States],
    ) -> LocalNetwork:  # fmt: skip
        c = self.problem.space.to_coordinates(self.unknowns[:COORDINATE_COUNT])
        _, late = self.problem.further_delays(self.unknowns)
        mesh = make_mesh(
            [p.inputs for p in pieces], [p.span for p in pieces], slips, c.D_y, c.eta,
            [p.piece.drive_delay + late for p in pieces], stretched=self.settings.features != "time",
        )  # fmt: skip
        network = before or LocalNetwork(layer, mesh, Heads.nothing())
        return network.fitted(mesh, states, gauss_points(self.size.points)[0])


def _misfit(loss: LocalLoss, unknowns: Array, heads: Heads) -> Misfit:
    squares, samples, asked = np.zeros(4), 0.0, 0.0
    for b, (hysteresis, balance, force) in zip(loss.batches, loss.residuals(unknowns, heads), strict=True):
        share = b.share / b.slip_velocity[:, None]
        rough = b.motion[1] * share
        parts = (force * b.counts, hysteresis * share, balance * b.share, rough - (rough @ b.tests) @ b.tests.T)
        squares += [float((part**2).sum()) for part in parts]
        samples += float((b.counts**2).sum())
        asked += float((b.share**2).sum())
    return Misfit(*np.sqrt(squares / np.array([max(samples, 1.0), asked, asked, asked])).tolist())


def _node_prior(piece: Piece) -> NodePrior:
    x = piece.stroke.displacement
    return NodePrior(float(x.mean()) / Y_UNIT, 0.5 * float(np.ptp(x)) / Y_UNIT)


def coarse(problem: Problem) -> Problem:
    """The same with each force channel's filter taken for a delay."""

    def without(piece: Piece) -> Piece:
        if piece.low_pass is None:
            return piece
        lag = filter_lag(piece.low_pass.reported)
        return replace(piece, low_pass=None, force_delay=piece.force_delay + lag)

    return replace(problem, pieces=tuple(without(p) for p in problem.pieces))

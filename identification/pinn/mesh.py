"""The elements on which the local network has its heads, and the states that it makes there.

An element reaches from one reversal of the slip, or one step of the drive, to the next. Within it z and y are
linear heads on the shared hidden layer; neighbours share their values at the node between them.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from identification.arrays import Array
from identification.pinn.hidden_layer import HiddenLayer
from identification.pinn.inputs import Inputs
from identification.pinn.memory_input import MemoryInput, after_reversal, after_step, anywhere, plain
from identification.pinn.reversals import reversals

Indices = npt.NDArray[np.int64]

Y_UNIT = 1e-3
"""[m] what a head of one means for y."""
_APART = 2.5e-3
"""[s] least length of an element."""
_SLIP_POINTS = 150
_MIX = 0.143
_SLOW = 0.143
"""[1] of the usual velocity: slip at breakthrough where no reversal shows it."""
_FIT_RIDGE = 1e-6

SlipVelocity = Callable[[Array], Array]
"""x' - y' [m/s] at times [s] of one piece."""


class Span(NamedTuple):
    """The part of a piece that is learned, on its own time [s]."""

    start: float
    end: float


class Element(NamedTuple):
    """One stretch of time with heads of its own."""

    piece: int
    start: float
    """[s]"""
    memory: MemoryInput
    left: int
    """Number of the node at its start; that at its end is the next."""
    slip_velocity: float
    """[m/s] usual while the hysteresis breaks through: what a violation of its law is measured by."""

    @property
    def end(self) -> float:
        """Where it ends [s]."""
        return self.start + self.memory.length


@dataclass(frozen=True)
class Mesh:
    """All elements, piece after piece in time."""

    elements: tuple[Element, ...]
    reversals: tuple[Array, ...]
    """[s] of each piece."""

    @property
    def nodes(self) -> int:
        """How many there are."""
        return self.elements[-1].left + 2

    @cached_property
    def lefts(self) -> Indices:
        """Left node of each element."""
        return np.array([e.left for e in self.elements], np.int64)

    def of_piece(self, piece: int) -> Indices:
        """Numbers of a piece's elements."""
        return np.flatnonzero([e.piece == piece for e in self.elements])

    def moved(self, before: "Mesh") -> float:
        """Largest shift [s] of a reversal since another mesh; infinite where their number changed."""
        pairs = list(zip(self.reversals, before.reversals, strict=True))
        if any(len(a) != len(b) for a, b in pairs):
            return float("inf")
        return max((float(np.abs(a - b).max(initial=0.0)) for a, b in pairs), default=0.0)


def make_mesh(
    inputs: Sequence[Inputs],
    spans: Sequence[Span],
    slips: Sequence[SlipVelocity],
    yield_displacement: float,
    eta: float,
    drive_delays: Sequence[float],
    *,
    stretched: bool = True,
) -> Mesh:
    """Elements between reversals of the slip and steps of the drive, for the present state of the network.

    Args:
        inputs: of each piece.
        spans: what of each is learned.
        slips: slip velocity of each.
        yield_displacement: [m].
        eta: rate of the field [1/s].
        drive_delays: by which the drive arrives late in each piece [s].
        stretched: whether the input follows the breakthrough; else it is time.
    """
    elements: list[Element] = []
    turns = []
    node = 0
    for piece, (given, span, slip, delay) in enumerate(zip(inputs, spans, slips, drive_delays, strict=True)):
        grid = np.arange(span.start, span.end, given.h)
        turn = reversals(grid, slip(grid), yield_displacement)
        turns.append(turn)
        edges, kinds = _edges(span, turn, given.steps(delay, _APART))
        lengths = np.diff(edges)
        memories = [
            _memory(kind, start, float(length), slip, yield_displacement, eta)
            for kind, start, length in zip(kinds[:-1], edges[:-1], lengths, strict=True)
        ]
        paces = _paces(kinds[:-1], memories, yield_displacement, given.usual_velocity)
        for start, memory, pace in zip(edges[:-1], memories, paces, strict=True):
            shown = memory if stretched else plain(memory.length)
            elements.append(Element(piece, start, shown, node, pace))
            node += 1
        node += 1
    return Mesh(tuple(elements), tuple(turns))


def _edges(span: Span, turns: Array, steps: Array) -> tuple[list[float], list[str]]:
    """Ends of the elements [s] in their order, and what each is."""
    inner = [(float(t), "reversal") for t in turns] + [(float(t), "step") for t in steps]
    kept: list[tuple[float, str]] = [(span.start, "start")]
    for time, kind in sorted(inner):
        if span.start + _APART < time < span.end - _APART and time - kept[-1][0] > _APART:
            kept.append((time, kind))
    kept.append((span.end, "end"))
    return [time for time, _ in kept], [kind for _, kind in kept]


def _memory(
    kind: str, start: float, length: float, slip: SlipVelocity, yield_displacement: float, eta: float
) -> MemoryInput:
    if kind == "reversal":
        time = length * np.linspace(0.0, 1.0, _SLIP_POINTS) ** 1.5
        return after_reversal(length, time, slip(start + time), yield_displacement)
    return after_step(length, eta) if kind == "step" else anywhere(length)


def _paces(
    kinds: Sequence[str], memories: Sequence[MemoryInput], yield_displacement: float, usual: float
) -> list[float]:
    """Slip velocity [m/s] of each element at its breakthrough; elsewhere that of the reversal before."""
    own = [
        (_MIX * yield_displacement / memory.width * usual) ** 0.5 if kind == "reversal" else None
        for kind, memory in zip(kinds, memories, strict=True)
    ]
    last = next((pace for pace in own if pace is not None), _SLOW * usual)
    found = []
    for pace in own:
        last = last if pace is None else pace
        found.append(last)
    return found


class Heads(NamedTuple):
    """The weights of all heads; y in units of ``Y_UNIT``."""

    node_z: Array
    """(nodes,)"""
    node_y: Array
    inner_z: Array
    """(elements, rank - 2)"""
    inner_y: Array

    @staticmethod
    def nothing() -> "Heads":
        """No weights yet."""
        return Heads(*(np.empty(0) for _ in range(4)))

    def of(self, left: Indices, elements: Indices) -> tuple[Array, Array]:
        """Heads (K, rank) of z and y of some elements with these left nodes."""

        def together(node: Array, inner: Array) -> Array:
            return np.column_stack([node[left], node[left + 1], inner[elements]])

        return together(self.node_z, self.inner_z), together(self.node_y, self.inner_y)

    def moved(self, step: "Heads", share: float) -> "Heads":
        """A share of the way along a step."""
        return Heads(*(here + share * way for here, way in zip(self, step, strict=True)))


class States(NamedTuple):
    """What the network says at some times, (N,) each."""

    z: Array
    """[1] over its saturation."""
    y: Array
    """[m]"""
    y_rate: Array
    """[m/s]"""


@dataclass(frozen=True)
class LocalNetwork:
    """Hidden layer, elements and heads together: a function of time for each piece."""

    layer: HiddenLayer
    mesh: Mesh
    heads: Heads

    def at(self, piece: int, time: Array) -> States:
        """States of a piece at times (N,) [s]; beyond its ends as at them."""
        numbers, place, rate = self._places(piece, time)
        z, y = self._heads_of(numbers)
        values, slopes = self.layer.values_and_slopes(place)
        return States((values * z).sum(1), (values * y).sum(1) * Y_UNIT, (slopes * y).sum(1) * rate * Y_UNIT)

    def inner_velocity(self, piece: int, time: Array) -> Array:
        """Y' [m/s] of a piece at times (N,) [s]."""
        numbers, place, rate = self._places(piece, time)
        _, y = self._heads_of(numbers)
        return np.asarray((self.layer.slopes(place) * y).sum(1) * rate * Y_UNIT)

    def _places(self, piece: int, time: Array) -> tuple[Indices, Array, Array]:
        """Element of each time, the input there [1] and its rate [1/s]."""
        mine = self.mesh.of_piece(piece)
        starts = np.array([self.mesh.elements[k].start for k in mine])
        which = np.clip(np.searchsorted(starts, time, side="right") - 1, 0, len(mine) - 1)
        place, rate = np.empty(len(time)), np.empty(len(time))
        for j in np.unique(which):
            element, here = self.mesh.elements[mine[j]], which == j
            since = np.clip(time[here] - element.start, 0.0, element.memory.length)
            place[here], rate[here], _ = element.memory.at(since)
        return mine[which], place, rate

    def _heads_of(self, numbers: Indices) -> tuple[Array, Array]:
        """Heads (N, rank) of z and y of the elements with these numbers."""
        return self.heads.of(self.mesh.lefts[numbers], numbers)

    def fitted(self, mesh: Mesh, states: Callable[[int, Array], States], points: Array) -> "LocalNetwork":
        """The network on another mesh, its heads fitted to given states at ``points`` (M,) of each element."""
        rank, functions = self.layer.rank, self.layer.values(points)
        node_z, node_y = np.zeros(mesh.nodes), np.zeros(mesh.nodes)
        targets = []
        for piece in {e.piece: None for e in mesh.elements}:
            mine = [mesh.elements[k] for k in mesh.of_piece(piece)]
            nodes = states(piece, np.array([e.start for e in mine] + [mine[-1].end]))
            first = mine[0].left
            node_z[first : first + len(mine) + 1], node_y[first : first + len(mine) + 1] = nodes.z, nodes.y
            inside = states(piece, np.concatenate([e.start + e.memory.time(points) for e in mine]))
            targets.append(np.stack([inside.z, inside.y / Y_UNIT]).reshape(2, len(mine), len(points)))
        node_y /= Y_UNIT
        left = mesh.lefts
        ends = np.stack([np.stack([node[left], node[left + 1]], 1) for node in (node_z, node_y)])
        rest = np.concatenate(targets, axis=1) - ends @ functions[:, :2].T
        table = np.vstack([functions[:, 2:], _FIT_RIDGE * np.eye(rank - 2)])
        inner = np.linalg.pinv(table)[:, : len(points)]
        z, y = rest @ inner.T
        return replace(self, mesh=mesh, heads=Heads(node_z, node_y, z, y))

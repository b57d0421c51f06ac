"""Mesh of time elements, and the states of the network on it.

An element extends from one reversal of the slip, or one drive step, to the next. Within it, z and y are linear
combinations of the shared basis functions. Neighbouring elements share their values at the node between them.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.pinn.common import (
    Y_UNIT,
    Indices,
    PieceInputs,
    SlipVelocity,
    States,
    TimeMap,
    TimeSpan,
    find_reversals,
    make_default_map,
    make_linear_map,
    make_reversal_map,
    make_slip_times,
    make_step_map,
)
from identification.pinn.elements.hidden_layer import HiddenLayer

_MIN_ELEMENT_LENGTH = 2.5e-3
"""Shortest element [s]."""
_BREAKTHROUGH_FACTOR = 0.143
"""Factor of the slip velocity at breakthrough, sqrt(factor * D_y / width * rms velocity) [1]."""
_DEFAULT_SLIP = 0.143
"""Slip velocity at breakthrough over the rms velocity [1], for elements before any reversal."""
_FIT_RIDGE = 1e-6


class Element(NamedTuple):
    """Interval of time with output weights of its own."""

    piece: int
    start: float
    """Start [s]."""
    time_map: TimeMap
    left_node: int
    """Number of the node at its start; the node at its end is the next one."""
    slip_velocity: float
    """Typical slip velocity at breakthrough [m/s], which scales hysteresis residuals."""

    @property
    def end(self) -> float:
        """End [s]."""
        return self.start + self.time_map.length


@dataclass(frozen=True)
class Mesh:
    """All elements of a problem, piece after piece in order of time."""

    elements: tuple[Element, ...]
    reversals: tuple[Array, ...]
    """Reversals of the slip in each piece [s]."""

    @property
    def node_count(self) -> int:
        """Number of nodes."""
        return self.elements[-1].left_node + 2

    @cached_property
    def left_nodes(self) -> Indices:
        """Left node of each element."""
        return np.array([e.left_node for e in self.elements], np.int64)

    def find_elements(self, piece: int) -> Indices:
        """Return the numbers of a piece's elements."""
        return np.flatnonzero([e.piece == piece for e in self.elements])

    def measure_shift(self, before: "Mesh") -> float:
        """Return the largest shift [s] of a reversal from another mesh; infinite if their number changed."""
        pairs = list(zip(self.reversals, before.reversals, strict=True))
        if any(len(a) != len(b) for a, b in pairs):
            return float("inf")
        return max((float(np.abs(a - b).max(initial=0.0)) for a, b in pairs), default=0.0)


def make_mesh(
    inputs: Sequence[PieceInputs],
    spans: Sequence[TimeSpan],
    slips: Sequence[SlipVelocity],
    yield_displacement: float,
    eta: float,
    drive_delays: Sequence[float],
    *,
    follow_breakthrough: bool = True,
) -> Mesh:
    """Return the elements between reversals of the slip and drive steps.

    Args:
        inputs: inputs of each piece.
        spans: learned span of each piece.
        slips: slip velocity of each piece, for the present state of the network.
        yield_displacement: yield displacement [m].
        eta: rate of the field [1/s].
        drive_delays: delay of the drive in each piece [s].
        follow_breakthrough: whether the input is finest at the breakthrough; plain time is a research option.
    """
    elements: list[Element] = []
    reversals = []
    node = 0
    for piece, (given, span, slip, delay) in enumerate(zip(inputs, spans, slips, drive_delays, strict=True)):
        grid = np.arange(span.start, span.end, given.h)
        reversals.append(find_reversals(grid, slip(grid), yield_displacement))
        edges, kinds = _find_edges(span, reversals[-1], given.find_drive_steps(delay, _MIN_ELEMENT_LENGTH))
        lengths = np.diff(edges)
        maps = [
            _make_time_map(kind, start, float(length), slip, yield_displacement, eta)
            for kind, start, length in zip(kinds[:-1], edges[:-1], lengths, strict=True)
        ]
        slip_velocities = _estimate_slip_velocities(kinds[:-1], maps, yield_displacement, given.rms_velocity)
        for start, time_map, slip_velocity in zip(edges[:-1], maps, slip_velocities, strict=True):
            shown = time_map if follow_breakthrough else make_linear_map(time_map.length)
            elements.append(Element(piece, start, shown, node, slip_velocity))
            node += 1
        node += 1
    return Mesh(tuple(elements), tuple(reversals))


def _find_edges(span: TimeSpan, reversals: Array, steps: Array) -> tuple[list[float], list[str]]:
    """Return the edges of the elements [s] in order of time, and the kind of each."""
    inner = [(float(t), "reversal") for t in reversals] + [(float(t), "step") for t in steps]
    edges: list[tuple[float, str]] = [(span.start, "start")]
    for time, kind in sorted(inner):
        if (
            span.start + _MIN_ELEMENT_LENGTH < time < span.end - _MIN_ELEMENT_LENGTH
            and time - edges[-1][0] > _MIN_ELEMENT_LENGTH
        ):
            edges.append((time, kind))
    edges.append((span.end, "end"))
    return [time for time, _ in edges], [kind for _, kind in edges]


def _make_time_map(
    kind: str, start: float, length: float, slip: SlipVelocity, yield_displacement: float, eta: float
) -> TimeMap:
    if kind == "reversal":
        time = make_slip_times(length)
        return make_reversal_map(length, time, slip(start + time), yield_displacement)
    return make_step_map(length, eta) if kind == "step" else make_default_map(length)


def _estimate_slip_velocities(
    kinds: Sequence[str], maps: Sequence[TimeMap], yield_displacement: float, rms_velocity: float
) -> list[float]:
    """Return the slip velocity [m/s] at each element's breakthrough; without one, that of the reversal before."""
    estimates = [
        (_BREAKTHROUGH_FACTOR * yield_displacement / time_map.width * rms_velocity) ** 0.5
        if kind == "reversal"
        else None
        for kind, time_map in zip(kinds, maps, strict=True)
    ]
    last = next((value for value in estimates if value is not None), _DEFAULT_SLIP * rms_velocity)
    velocities = []
    for value in estimates:
        last = last if value is None else value
        velocities.append(last)
    return velocities


class OutputWeights(NamedTuple):
    """Output weights of all elements; those of y are in units of ``Y_UNIT``."""

    node_z: Array
    """Weights of z at the nodes (nodes,)."""
    node_y: Array
    """Weights of y at the nodes (nodes,)."""
    inner_z: Array
    """Weights of z inside the elements (elements, rank - 2)."""
    inner_y: Array
    """Weights of y inside the elements (elements, rank - 2)."""

    @staticmethod
    def make_empty() -> "OutputWeights":
        """Return empty weights for a network that is not fitted yet."""
        return OutputWeights(*(np.empty(0) for _ in range(4)))

    def select(self, left: Indices, elements: Indices) -> tuple[Array, Array]:
        """Return the weights (K, rank) of z and y of elements with these left nodes."""

        def join(node: Array, inner: Array) -> Array:
            return np.column_stack([node[left], node[left + 1], inner[elements]])

        return join(self.node_z, self.inner_z), join(self.node_y, self.inner_y)

    def move(self, step: "OutputWeights", share: float) -> "OutputWeights":
        """Return the weights after a share of a step."""
        return OutputWeights(*(weight + share * change for weight, change in zip(self, step, strict=True)))


@dataclass(frozen=True)
class ElementNetwork:
    """Hidden layer, elements and output weights: a function of time for each piece."""

    layer: HiddenLayer
    mesh: Mesh
    output_weights: OutputWeights

    def evaluate_states(self, piece: int, time: Array) -> States:
        """Return the states of a piece at times (N,) [s]; beyond its ends, those at the ends."""
        numbers, place, rate = self._locate(piece, time)
        z, y = self._select_weights(numbers)
        values, slopes = self.layer.evaluate(place), self.layer.differentiate(place)
        return States((values * z).sum(1), (values * y).sum(1) * Y_UNIT, (slopes * y).sum(1) * rate * Y_UNIT)

    def evaluate_inner_velocity(self, piece: int, time: Array) -> Array:
        """Return y' [m/s] of a piece at times (N,) [s]."""
        numbers, place, rate = self._locate(piece, time)
        _, y = self._select_weights(numbers)
        return np.asarray((self.layer.differentiate(place) * y).sum(1) * rate * Y_UNIT)

    def _locate(self, piece: int, time: Array) -> tuple[Indices, Array, Array]:
        """Return the element of each time, its input [1] and the input's rate [1/s]."""
        numbers = self.mesh.find_elements(piece)
        starts = np.array([self.mesh.elements[k].start for k in numbers])
        which = np.clip(np.searchsorted(starts, time, side="right") - 1, 0, len(numbers) - 1)
        place, rate = np.empty(len(time)), np.empty(len(time))
        for j in np.unique(which):
            element, mask = self.mesh.elements[numbers[j]], which == j
            since = np.clip(time[mask] - element.start, 0.0, element.time_map.length)
            place[mask], rate[mask], _ = element.time_map.evaluate(since)
        return numbers[which], place, rate

    def _select_weights(self, numbers: Indices) -> tuple[Array, Array]:
        """Return the weights (N, rank) of z and y of elements with these numbers."""
        return self.output_weights.select(self.mesh.left_nodes[numbers], numbers)

    def refit(self, mesh: Mesh, states: Callable[[int, Array], States], points: Array) -> "ElementNetwork":
        """Return the network on another mesh, its weights fitted to states at ``points`` (M,) of each element."""
        functions = self.layer.evaluate(points)
        node_z, node_y = np.zeros(mesh.node_count), np.zeros(mesh.node_count)
        targets = []
        for piece in {e.piece: None for e in mesh.elements}:
            elements = [mesh.elements[k] for k in mesh.find_elements(piece)]
            nodes = states(piece, np.array([e.start for e in elements] + [elements[-1].end]))
            first = elements[0].left_node
            node_z[first : first + len(elements) + 1] = nodes.z
            node_y[first : first + len(elements) + 1] = nodes.y
            inside = states(piece, np.concatenate([e.start + e.time_map.invert(points) for e in elements]))
            targets.append(np.stack([inside.z, inside.y / Y_UNIT]).reshape(2, len(elements), len(points)))
        node_y /= Y_UNIT
        left = mesh.left_nodes
        ends = np.stack([np.stack([node[left], node[left + 1]], 1) for node in (node_z, node_y)])
        z, y = _fit_inner_weights(functions[:, 2:], np.concatenate(targets, axis=1) - ends @ functions[:, :2].T)
        return replace(self, mesh=mesh, output_weights=OutputWeights(node_z, node_y, z, y))


def _fit_inner_weights(functions: Array, remainder: Array) -> Array:
    """Return the weights (2, elements, rank - 2) of functions (M, rank - 2) for values (2, elements, M) inside."""
    points, count = functions.shape
    # Without a ridge, nearly dependent functions would get large weights of opposite sign.
    projection = np.linalg.pinv(np.vstack([functions, _FIT_RIDGE * np.eye(count)]))[:, :points]
    return np.asarray(remainder @ projection.T)

"""One Gauss-Newton step over all output weights and shared unknowns, by orthogonal factorisations only.

The output weights inside an element appear in its own residuals alone, so they are eliminated there (variable
projection, Golub and Pereyra 1973). The nodes form a chain in each piece and are eliminated one after the other.
The columns of the shared unknowns remain: fifteen, and the parameters of effects. Normal equations would square a
condition number that is large already.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular

from identification.arrays import Array, BoolArray
from identification.pinn.common import Batch
from identification.pinn.elements.mesh import Mesh, OutputWeights
from identification.pinn.elements.residuals import WeightedResiduals

_RIDGE = 1e-6
"""Ridge [1] that keeps output weights finite that no residual depends on."""
_NODE_COLUMNS = 4
"""Number of columns of an element's nodes: z and y at its left, z and y at its right."""


class NodePrior(NamedTuple):
    """Prior of y at the first node of a piece, in units of the output weights."""

    centre: float
    deviation: float


@dataclass(frozen=True)
class Factorisation:
    """Residuals of one linearisation, with everything but the shared unknowns eliminated."""

    triangle: Array
    """Triangular rows (R, C + 1) over the C shared unknowns, right-hand side last."""
    inner: list[Array]
    """Triangular rows (K, I, I + 4 + C + 1) of the I inner weights, for each batch."""
    nodes: list[list[Array]]
    """Rows (2, 2 + 2 + C + 1) of each node over itself, the next node and the shared unknowns, for each piece."""

    def compute_information(self) -> Array:
        """Return the information matrix (C, C) of the shared unknowns, output weights marginalised."""
        R = self.triangle[:, :-1]
        return np.asarray(R.T @ R)

    def solve_step(self, free: BoolArray, damping: Array, low: Array, high: Array) -> Array:
        """Return the step (C,) of the shared unknowns within bounds.

        An unknown that would leave its bounds is set to the bound, and the others are solved again.

        Args:
            free: which unknowns may move (C,).
            damping: terms (C,) added to the information's diagonal.
            low, high: bounds of the step (C,).
        """
        step, moving = np.zeros(len(free)), free.copy()
        for _ in range(len(free)):
            step[moving] = self._solve_unbounded(step, moving, damping)
            outside = moving & ((step < low) | (step > high))
            if not outside.any():
                break
            step = np.where(outside, np.clip(step, low, high), step)
            moving &= ~outside
        return step

    def _solve_unbounded(self, step: Array, moving: BoolArray, damping: Array) -> Array:
        """Return the least-squares step of the moving unknowns, with all others fixed."""
        table = np.vstack([self.triangle[:, :-1][:, moving], np.diag(np.sqrt(damping[moving]))])
        fixed = self.triangle[:, :-1][:, ~moving] @ step[~moving]
        right = np.concatenate([self.triangle[:, -1] - fixed, np.zeros(int(moving.sum()))])
        return np.asarray(np.linalg.lstsq(table, right, rcond=None)[0])

    def solve_output_weights(self, step: Array, mesh: Mesh, batches: Sequence[Batch]) -> OutputWeights:
        """Return the step of the output weights that belongs to a step of the shared unknowns."""
        node = np.zeros((mesh.node_count, 2))
        for piece, rows in enumerate(self.nodes):
            first = mesh.elements[int(mesh.find_elements(piece)[0])].left_node
            node[first : first + len(rows)] = _solve_nodes(rows, step)
        count = self.inner[0].shape[1]
        inner = np.zeros((len(mesh.elements), count))
        for b, R in zip(batches, self.inner, strict=True):
            ends = np.hstack([node[b.left_node], node[b.left_node + 1]])
            known = np.hstack([ends, np.broadcast_to(step, (len(ends), len(step)))])
            remainder = R[..., -1] - (R[..., count:-1] @ known[..., None])[..., 0]
            inner[b.elements] = solve_triangular(R[..., :count], remainder[..., None])[..., 0]
        half = count // 2
        return OutputWeights(node[:, 0], node[:, 1], inner[:, :half], inner[:, half:])


def _solve_nodes(rows: Sequence[Array], step: Array) -> Array:
    """Return the nodes (nodes, 2) of one piece for a step of the shared unknowns, from the last one backwards."""
    nodes, after = np.empty((len(rows), 2)), np.zeros(2)
    # The chain was eliminated forwards in time, so only the last node depends on no other one.
    for k in range(len(rows) - 1, -1, -1):
        row = rows[k]
        right = row[:, -1] - row[:, 2:4] @ after - row[:, 4:-1] @ step
        nodes[k] = after = np.asarray(np.linalg.solve(row[:, :2], right))
    return nodes


def factorise(
    residuals: Sequence[WeightedResiduals],
    batches: Sequence[Batch],
    mesh: Mesh,
    output_weights: OutputWeights,
    priors: Sequence[NodePrior],
) -> Factorisation:
    """Eliminate all output weights from the residuals of one linearisation.

    Args:
        residuals: weighted residuals of each batch, with their Jacobian.
        batches: the batches.
        mesh: mesh of the elements.
        output_weights: present weights.
        priors: prior of the first node of each piece.
    """
    inner, remainder = [], {}
    inner_count = output_weights.inner_z.shape[1]
    for batch, batch_residuals in zip(batches, residuals, strict=True):
        R = _eliminate_elements(batch_residuals, inner_count + 2)
        inner.append(R[:, : 2 * inner_count])
        blocks = R[:, 2 * inner_count :, 2 * inner_count :]
        remainder.update(dict(zip(batch.elements.tolist(), blocks, strict=True)))
    triangles, nodes = [], []
    for piece, prior in enumerate(priors):
        numbers = mesh.find_elements(piece)
        first_y = float(output_weights.node_y[mesh.elements[int(numbers[0])].left_node])
        triangle, chain = _eliminate_chain(
            [remainder[int(k)] for k in numbers], (prior.centre - first_y) / prior.deviation, prior
        )
        triangles.append(triangle)
        nodes.append(chain)
    return Factorisation(_triangularise(np.vstack(triangles)), inner, nodes)


def _eliminate_elements(residuals: WeightedResiduals, rank: int) -> Array:
    """Return triangles (K, W, W) with columns of inner weights, nodes, shared unknowns and right-hand side."""
    if residuals.jacobian is None:
        raise AssertionError("weighted residuals without a Jacobian cannot be factorised")
    elements, count, columns = residuals.jacobian.shape
    ridge_rows = 2 * rank
    z, y, shared = np.arange(2, rank), np.arange(rank + 2, 2 * rank), np.arange(2 * rank, columns)
    order = np.concatenate([z, y, [0, rank, 1, rank + 1], shared])
    table = np.zeros((elements, count + ridge_rows, columns + 1))
    table[:, :count, :-1] = residuals.jacobian[..., order]
    table[:, :count, -1] = -residuals.vector
    table[:, np.arange(count, count + ridge_rows), np.arange(ridge_rows)] = _RIDGE
    return np.asarray(np.linalg.qr(table, mode="r"))


def _triangularise(rows: Array) -> Array:
    """Return the upper triangle that is equivalent to these rows."""
    return np.asarray(np.linalg.qr(rows, mode="r"))


def _eliminate_chain(
    elements: Sequence[Array], prior_residual: float, prior: NodePrior
) -> tuple[Array, list[Array]]:
    """Return a piece's rows over the shared unknowns, and the rows from which its nodes are solved."""
    width = elements[0].shape[1]
    carry = np.zeros((1, width))
    carry[0, 1], carry[0, -1] = 1.0 / prior.deviation, prior_residual
    nodes = []
    for triangle in elements:
        R = _triangularise(np.vstack([carry, triangle]))
        nodes.append(R[:2])
        carry = np.zeros((len(R) - 2, width))
        carry[:, :2], carry[:, _NODE_COLUMNS:] = R[2:, 2:_NODE_COLUMNS], R[2:, _NODE_COLUMNS:]
    R = _triangularise(np.delete(carry, [2, 3], axis=1))
    nodes.append(np.insert(R[:2], [2, 2], 0.0, axis=1))
    return R[2:, 2:], nodes

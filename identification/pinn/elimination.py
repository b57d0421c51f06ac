"""One Gauss-Newton step over all weights and parameters, by orthogonal factorisations only.

The heads inside an element appear in its own rows alone, so they are eliminated there (variable projection, Golub
and Pereyra 1973); the nodes form a chain in each piece and go one after the other; what is left are the columns of
the unknowns that all share: fifteen, and the parameters of effects beside the law. Normal equations would square a
condition number that is large already.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular

from identification.arrays import Array, BoolArray
from identification.pinn.batches import Batch
from identification.pinn.local_rows import Rows
from identification.pinn.mesh import Heads, Mesh

_RIDGE = 1e-6
"""[1] holds heads that no row sees."""
_NODES = 4
"""Columns of an element's nodes: z and y at its left, z and y at its right."""


class NodePrior(NamedTuple):
    """What is known of y at the first node of a piece, in units of the heads."""

    centre: float
    deviation: float


@dataclass(frozen=True)
class Factorised:
    """All rows of one linearisation, with everything but the shared unknowns eliminated."""

    triangle: Array
    """(R, C + 1) rows over the C shared unknowns, right-hand side last."""
    inner: list[Array]
    """Of each batch: (K, I, I + 4 + C + 1) triangular rows of its inner heads."""
    nodes: list[list[Array]]
    """Of each piece: (2, 2 + 2 + C + 1) rows of each node over itself, the next one and the shared unknowns."""

    def information(self) -> Array:
        """(C, C) of the shared unknowns, heads marginalised."""
        R = self.triangle[:, :-1]
        return np.asarray(R.T @ R)

    def step(self, free: BoolArray, damping: Array, low: Array, high: Array) -> Array:
        """(C,) of the shared unknowns; one that would leave its range goes to the edge, and the others know.

        Args:
            free: (C,) which may move.
            damping: (C,) added to the information's diagonal.
            low: (C,) furthest down that each may go.
            high: (C,) furthest up.
        """
        found, moving = np.zeros(len(free)), free.copy()
        for _ in range(len(free)):
            found[moving] = self._unbounded(found, moving, damping)
            outside = moving & ((found < low) | (found > high))
            if not outside.any():
                break
            found = np.where(outside, np.clip(found, low, high), found)
            moving &= ~outside
        return found

    def _unbounded(self, found: Array, moving: BoolArray, damping: Array) -> Array:
        """Least squares over those that move, the others where they are."""
        table = np.vstack([self.triangle[:, :-1][:, moving], np.diag(np.sqrt(damping[moving]))])
        still = self.triangle[:, :-1][:, ~moving] @ found[~moving]
        right = np.concatenate([self.triangle[:, -1] - still, np.zeros(int(moving.sum()))])
        return np.asarray(np.linalg.lstsq(table, right, rcond=None)[0])

    def heads(self, step: Array, mesh: Mesh, batches: Sequence[Batch]) -> Heads:
        """The heads' own step that goes with a step of the shared unknowns."""
        node = np.zeros((mesh.nodes, 2))
        for piece, rows in enumerate(self.nodes):
            first = mesh.elements[int(mesh.of_piece(piece)[0])].left
            after = np.zeros(2)
            for k in range(len(rows) - 1, -1, -1):
                row = rows[k]
                right = row[:, -1] - row[:, 2:4] @ after - row[:, 4:-1] @ step
                after = np.asarray(np.linalg.solve(row[:, :2], right))
                node[first + k] = after
        count = self.inner[0].shape[1]
        inner = np.zeros((len(mesh.elements), count))
        for b, R in zip(batches, self.inner, strict=True):
            ends = np.hstack([node[b.left], node[b.left + 1]])
            known = np.hstack([ends, np.broadcast_to(step, (len(ends), len(step)))])
            rest = R[..., -1] - (R[..., count:-1] @ known[..., None])[..., 0]
            inner[b.elements] = solve_triangular(R[..., :count], rest[..., None])[..., 0]
        half = count // 2
        return Heads(node[:, 0], node[:, 1], inner[:, :half], inner[:, half:])


def factorise(
    rows: Sequence[Rows], batches: Sequence[Batch], mesh: Mesh, heads: Heads, priors: Sequence[NodePrior]
) -> Factorised:
    """Eliminate all heads from the rows of one linearisation."""
    inner, rest = [], {}
    for batch, row in zip(batches, rows, strict=True):
        count = 2 * heads.inner_z.shape[1]
        R = _eliminated(row, heads.inner_z.shape[1] + 2)
        inner.append(R[:, :count])
        rest.update(dict(zip(batch.elements.tolist(), R[:, count:, count:], strict=True)))
    triangles, nodes = [], []
    for piece, prior in enumerate(priors):
        mine = mesh.of_piece(piece)
        now = float(heads.node_y[mesh.elements[int(mine[0])].left])
        triangle, chain = _along_the_chain(
            [rest[int(k)] for k in mine], (prior.centre - now) / prior.deviation, prior
        )
        triangles.append(triangle)
        nodes.append(chain)
    return Factorised(_triangle(np.vstack(triangles)), inner, nodes)


def _eliminated(row: Rows, rank: int) -> Array:
    """(K, W, W) triangles of the elements; columns: inner heads, nodes, shared unknowns, right-hand side."""
    if row.slopes is None:
        raise AssertionError("rows without slopes cannot be factorised")
    elements, count, columns = row.slopes.shape
    held = 2 * rank
    z, y, shared = np.arange(2, rank), np.arange(rank + 2, 2 * rank), np.arange(2 * rank, columns)
    order = np.concatenate([z, y, [0, rank, 1, rank + 1], shared])
    table = np.zeros((elements, count + held, columns + 1))
    table[:, :count, :-1] = row.slopes[..., order]
    table[:, :count, -1] = -row.all
    table[:, np.arange(count, count + held), np.arange(held)] = _RIDGE
    return np.asarray(np.linalg.qr(table, mode="r"))


def _triangle(rows: Array) -> Array:
    """The upper triangle that stands for these rows."""
    return np.asarray(np.linalg.qr(rows, mode="r"))


def _along_the_chain(elements: Sequence[Array], pulled: float, prior: NodePrior) -> tuple[Array, list[Array]]:
    """What a piece says of the shared unknowns, and the rows that give its nodes back."""
    width = elements[0].shape[1]
    carry = np.zeros((1, width))
    carry[0, 1], carry[0, -1] = 1.0 / prior.deviation, pulled
    nodes = []
    for triangle in elements:
        R = _triangle(np.vstack([carry, triangle]))
        nodes.append(R[:2])
        carry = np.zeros((len(R) - 2, width))
        carry[:, :2], carry[:, _NODES:] = R[2:, 2:_NODES], R[2:, _NODES:]
    R = _triangle(np.delete(carry, [2, 3], axis=1))
    nodes.append(np.insert(R[:2], [2, 2], 0.0, axis=1))
    return R[2:, 2:], nodes

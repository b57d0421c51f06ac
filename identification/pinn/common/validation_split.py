"""Split into training and validation samples, by blocks of time because neighbouring samples are redundant."""

from collections.abc import Sequence

import numpy as np

from identification.arrays import Array
from identification.fitting import Piece

_BLOCK_COUNT = 50
"""Number of blocks in a piece, unless they would be shorter than ``_MIN_BLOCK_LENGTH``."""
_MIN_BLOCK_LENGTH = 0.05
"""Shortest block [s]."""


def make_validation_masks(pieces: Sequence[Piece], share: float, seed: int) -> list[Array]:
    """Return a mask (N,) of each piece that is 1.0 where a fitted sample is set aside for validation.

    Args:
        pieces: pieces with the samples that may be fitted.
        share: fraction of the blocks to set aside [1].
        seed: seed of the random choice of blocks.
    """
    random = np.random.default_rng(seed)
    return [_make_mask(piece, share, random) for piece in pieces]


def _make_mask(piece: Piece, share: float, random: np.random.Generator) -> Array:
    fitted = np.flatnonzero(piece.train)
    mask = np.zeros(len(piece.train))
    count = min(_BLOCK_COUNT, int(len(fitted) / piece.excitation.rate / _MIN_BLOCK_LENGTH))
    blocks = np.array_split(fitted, max(count, 1))
    # The first and the last block are always fitted: a network cannot extrapolate beyond its training samples.
    inner = np.arange(1, len(blocks) - 1)
    for k in random.choice(inner, round(share * len(inner)), replace=False) if len(inner) else ():
        mask[blocks[k]] = 1.0
    return mask

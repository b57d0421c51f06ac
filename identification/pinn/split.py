"""Training and validation samples: blocks of time, because neighbouring samples say the same thing twice."""

from collections.abc import Sequence

import numpy as np

from identification.arrays import Array
from identification.piece import Piece

_BLOCKS = 50
"""Blocks of a piece, if they are not shorter than ``_SHORTEST``."""
_SHORTEST = 0.05
"""[s]"""


def validation_masks(pieces: Sequence[Piece], share: float, seed: int) -> list[Array]:
    """(N,) of each piece: 1.0 where a fitted sample is set aside.

    Args:
        pieces: with the samples that may be fitted.
        share: of the blocks to set aside [1].
        seed: of which they are.
    """
    random = np.random.default_rng(seed)
    return [_mask(piece, share, random) for piece in pieces]


def _mask(piece: Piece, share: float, random: np.random.Generator) -> Array:
    fitted = np.flatnonzero(piece.train)
    mask = np.zeros(len(piece.train))
    count = min(_BLOCKS, int(len(fitted) / piece.stroke.rate / _SHORTEST))
    blocks = np.array_split(fitted, max(count, 1))
    # The first and the last block stay: a network knows nothing beyond the ends of what it was trained on.
    inner = np.arange(1, len(blocks) - 1)
    for k in random.choice(inner, round(share * len(inner)), replace=False) if len(inner) else ():
        mask[blocks[k]] = 1.0
    return mask

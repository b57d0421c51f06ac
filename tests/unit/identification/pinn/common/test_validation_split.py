"""Validation blocks."""

import numpy as np
import pytest

from identification.pinn.common.validation_split import make_validation_masks
from tests.support.pinn_problem import make_problem


def test_validation_blocks_are_complete_inside_the_piece_and_of_the_requested_share():
    pieces = make_problem().pieces
    mask = make_validation_masks(pieces, 0.2, 4)[0]
    assert mask[pieces[0].train == 0].sum() == 0
    assert mask.mean() == pytest.approx(0.2, abs=0.03)
    lengths = np.diff(np.flatnonzero(np.diff(np.concatenate([[0], mask, [0]]))))[::2]
    assert lengths.min() >= 50
    assert mask[:50].sum() == mask[-50:].sum() == 0
    assert not np.array_equal(mask, make_validation_masks(pieces, 0.2, 5)[0])
    assert make_validation_masks(pieces, 0.0, 4)[0].sum() == 0

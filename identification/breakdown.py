"""Equations that break down, said in terms of the recordings behind them."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from identification.errors import NothingToFit


@contextmanager
def breakdown_in_words() -> Iterator[None]:
    """Say of equations that break down what it means for the recordings."""
    try:
        yield
    except (np.linalg.LinAlgError, ZeroDivisionError, FloatingPointError) as error:
        raise NothingToFit(
            f"these recordings determine no damper: the equations of the fit break down ({error}); record longer "
            "strokes, or look at the channels for what no damper does"
        ) from error

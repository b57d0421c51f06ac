"""Numerical errors of a fit, translated into their meaning for the recordings."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from identification.errors import UnusableDataError


@contextmanager
def translate_numerical_errors() -> Iterator[None]:
    """Raise singular equations and divisions by zero as unusable data."""
    try:
        yield
    except (np.linalg.LinAlgError, ZeroDivisionError, FloatingPointError) as error:
        raise UnusableDataError(
            f"these recordings do not determine a damper: the equations of the fit are singular ({error}); record "
            "longer strokes, or check the channels for implausible values"
        ) from error

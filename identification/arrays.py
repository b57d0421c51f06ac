"""The arrays of this room and the one place where functions are compiled."""

from collections.abc import Callable
from typing import TypeAlias, TypeVar, cast

import numba
import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]
"""Real numbers in SI units; the docstring at hand gives shape and unit."""

BoolArray: TypeAlias = npt.NDArray[np.bool_]
"""A mask over the same samples or unknowns."""

Function = TypeVar("Function", bound=Callable[..., object])


def compiled(function: Function) -> Function:
    """The function as machine code, kept on disk between processes; it releases the interpreter's lock."""
    return cast(Function, numba.njit(cache=True, nogil=True, error_model="numpy")(function))

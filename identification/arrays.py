"""The arrays of this room and the one place where functions are compiled."""

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias, TypeVar, cast

import numba
import numpy as np
import numpy.typing as npt
from platformdirs import user_cache_dir

Array: TypeAlias = npt.NDArray[np.float64]
"""Real numbers in SI units; the docstring at hand gives shape and unit."""

BoolArray: TypeAlias = npt.NDArray[np.bool_]
"""A mask over the same samples or unknowns."""

Function = TypeVar("Function", bound=Callable[..., object])


def cache_folder() -> Path:
    """Where this room keeps what it can make again; the variable MRBENCH_CACHE moves it."""
    return Path(os.environ.get("MRBENCH_CACHE") or user_cache_dir("mrbench"))


def _fingerprint() -> str:
    """Of every source of this room: compiled code is kept for exactly this physics and no other.

    The compiler's own cache looks at one file at a time and would not see that the law, which is compiled into
    its callers, has changed in another.
    """
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


# Before anything is compiled: numba asks for the folder when a function is decorated.
numba.config.CACHE_DIR = str(  # type: ignore[attr-defined]  # made by numba when it is imported
    cache_folder().resolve() / "compiled" / _fingerprint()
)


def compiled(function: Function) -> Function:
    """The function as machine code, kept on disk between processes; it releases the interpreter's lock."""
    # Dividing by zero gives inf, as in numpy: an unstable trial point costs infinity and stops no search.
    return cast(Function, numba.njit(cache=True, nogil=True, error_model="numpy")(function))


def compiled_within(function: Function) -> Function:
    """The same for what a march asks at every step: it becomes a part of its caller, without the cost of a call.

    Dividing by one number several times may become one division; nothing else is reordered.
    """
    found = numba.njit(
        cache=True, nogil=True, error_model="numpy", fastmath={"arcp", "contract"}, forceinline=True
    )
    return cast(Function, found(function))


def compiled_anew(function: Function) -> Function:
    """The same for a function that takes another one, made anew in every process.

    The compiler cannot keep such a function on disk: once two arguments were met, it fails on one that is gone.
    """
    return cast(Function, numba.njit(nogil=True, error_model="numpy")(function))

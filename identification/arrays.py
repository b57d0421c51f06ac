"""Array types, and just-in-time compilation with a cache on disk."""

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
"""Real numbers in SI units; docstrings state shape and unit."""

BoolArray: TypeAlias = npt.NDArray[np.bool_]
"""Mask over samples or unknowns."""

Function = TypeVar("Function", bound=Callable[..., object])


def find_cache_folder() -> Path:
    """Return the folder of all caches; the environment variable MRBENCH_CACHE overrides it."""
    return Path(os.environ.get("MRBENCH_CACHE") or user_cache_dir("mrbench"))


def _hash_sources() -> str:
    """Return the hash of all compiled sources: the physics of the damper and its simulation.

    The compiler's own cache checks one file at a time. It would miss a change of the law, which is compiled into
    callers in other files.
    """
    folder, digest = Path(__file__).parent, hashlib.sha256()
    sources = [path for name in ("damper", "simulate") for path in (folder / name).rglob("*.py")]
    for source in sorted([Path(__file__), *sources]):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


# Set before anything is compiled, because numba reads the folder when a function is decorated.
numba.config.CACHE_DIR = str(  # type: ignore[attr-defined]  # defined by numba on import
    find_cache_folder().resolve() / "compiled" / _hash_sources()
)


def njit_cached(function: Function) -> Function:
    """Compile a function with a cache on disk; it releases the interpreter's lock."""
    # Division by zero gives inf, as in numpy: an unstable trial point has infinite cost and stops no search.
    return cast(Function, numba.njit(cache=True, nogil=True, error_model="numpy")(function))


def njit_inline(function: Function) -> Function:
    """Compile a function that is called at every integration step, and inline it into its callers.

    Several divisions by one number may become one division. Nothing else is reordered.
    """
    compiler = numba.njit(
        cache=True, nogil=True, error_model="numpy", fastmath={"arcp", "contract"}, forceinline=True
    )
    return cast(Function, compiler(function))


def njit_uncached(function: Function) -> Function:
    """Compile a function that takes another function, separately in every process.

    The compiler cannot cache such a function on disk: after two different arguments it fails on one that no longer
    exists.
    """
    return cast(Function, numba.njit(nogil=True, error_model="numpy")(function))

"""The arrays of this room and the one place where functions are compiled."""

import hashlib
import os
from collections.abc import Callable, Sequence
from functools import reduce
from pathlib import Path
from typing import Any, TypeAlias, TypeVar, cast

import numba
import numpy as np
import numpy.typing as npt
from platformdirs import user_cache_dir

_COMPILED_FROM = ("sim_rig", "identification/damper")
"""Folders whose sources go into the machine code: a change in any of them makes all of it anew."""


def _keep_code_of_these_sources() -> None:
    """Keep compiled code apart for every state of the sources: a caller does not see what it calls change."""
    top, digest = Path(__file__).parents[1], hashlib.sha256()
    for source in sorted(path for folder in _COMPILED_FROM for path in (top / folder).rglob("*.py")):
        digest.update(source.read_bytes())
    cache = Path(os.environ.get("MRBENCH_CACHE") or user_cache_dir("mrbench")).resolve()
    folder = cache / "compiled" / f"rig-{digest.hexdigest()[:16]}"
    numba.config.CACHE_DIR = str(folder)  # type: ignore[attr-defined]  # made by numba when it is imported


_keep_code_of_these_sources()

Array: TypeAlias = npt.NDArray[np.float64]
"""Real numbers in SI units; the docstring at hand gives shape and unit."""

OfTwo: TypeAlias = Callable[[float, float], float]
"""A compiled function of two numbers that the plant takes as an argument."""

OfFour: TypeAlias = Callable[[float, float, float, float], float]
"""The same of four numbers."""

Scales: TypeAlias = Callable[[float, float, float], tuple[float, float, float]]
"""A compiled function of displacement [m], velocity [m/s] and energy [J]: factors of alpha, c0 and c1."""

Function = TypeVar("Function", bound=Callable[..., object])

_OF_TWO = numba.float64(numba.float64, numba.float64)
OF_TWO = numba.types.FunctionType(_OF_TWO)
"""The type of ``OfTwo`` in explicit signatures: one compiled plant then takes any of them."""
_OF_FOUR = numba.float64(numba.float64, numba.float64, numba.float64, numba.float64)
OF_FOUR = numba.types.FunctionType(_OF_FOUR)
"""The type of ``OfFour``."""
_THREE = numba.types.UniTuple(numba.float64, 3)  # type: ignore[no-untyped-call]
_SCALES = _THREE(numba.float64, numba.float64, numba.float64)
SCALES = numba.types.FunctionType(_SCALES)
"""The type of ``Scales``."""


def compiled(function: Function, signature: Any = None) -> Function:
    """The function as machine code, kept on disk between processes; it releases the interpreter's lock.

    With a signature it is compiled at once and for that alone, else when it is called.
    """
    # By numpy's rules a division by zero gives infinity, which the marches look for, and no exception.
    return cast(Function, numba.njit(signature, cache=True, nogil=True, error_model="numpy")(function))


def inlined(function: Function) -> Function:
    """The same of a small function that is set into its callers: handing arrays on costs more than it computes."""
    return cast(Function, numba.njit(cache=True, nogil=True, error_model="numpy", forceinline=True)(function))


def with_values(act: Callable[..., Any], values: Sequence[float]) -> OfTwo:
    """An effect's form with its parameters fixed, as a compiled function of its first two arguments."""
    form = numba.njit(nogil=True, error_model="numpy")(act)
    fixed = tuple(values)

    def acts(first: float, second: float) -> float:
        return float(form(first, second, *fixed))

    return cast(OfTwo, numba.njit(_OF_TWO, nogil=True, error_model="numpy")(acts))


def of_first(act: Callable[..., Any], values: Sequence[float]) -> OfTwo:
    """A form of one number with its parameters fixed, as a compiled function that leaves its second argument."""
    form, fixed = numba.njit(nogil=True, error_model="numpy")(act), tuple(values)

    def acts(first: float, second: float) -> float:
        return float(form(first, *fixed))

    return cast(OfTwo, numba.njit(_OF_TWO, nogil=True, error_model="numpy")(acts))


def of_first_two(act: Callable[..., Any], values: Sequence[float]) -> OfFour:
    """A form of two numbers with its parameters fixed, as a compiled function that leaves two more."""
    form, fixed = numba.njit(nogil=True, error_model="numpy")(act), tuple(values)

    def acts(one: float, two: float, three: float, four: float) -> float:
        return float(form(one, two, *fixed))

    return cast(OfFour, numba.njit(_OF_FOUR, nogil=True, error_model="numpy")(acts))


def of_first_three(act: Callable[..., Any], values: Sequence[float]) -> OfFour:
    """A form of three numbers with its parameters fixed, as a compiled function that leaves the fourth."""
    form, fixed = numba.njit(nogil=True, error_model="numpy")(act), tuple(values)

    def acts(one: float, two: float, three: float, four: float) -> float:
        return float(form(one, two, three, *fixed))

    return cast(OfFour, numba.njit(_OF_FOUR, nogil=True, error_model="numpy")(acts))


def of_all_but_third(act: Callable[..., Any], values: Sequence[float]) -> OfFour:
    """A form of three numbers with its parameters fixed, as a compiled function that leaves the third of four."""
    form, fixed = numba.njit(nogil=True, error_model="numpy")(act), tuple(values)

    def acts(one: float, two: float, three: float, four: float) -> float:
        return float(form(one, two, four, *fixed))

    return cast(OfFour, numba.njit(_OF_FOUR, nogil=True, error_model="numpy")(acts))


def of_energy(act: Callable[..., Any], values: Sequence[float]) -> Scales:
    """A form over the energy in the damper, as factors over displacement, velocity and energy."""
    form, fixed = numba.njit(nogil=True, error_model="numpy")(act), tuple(values)

    def scales(x: float, velocity: float, energy: float) -> tuple[float, float, float]:
        a, b, c = form(energy, *fixed)
        return float(a), float(b), float(c)

    return cast(Scales, numba.njit(_SCALES, nogil=True, error_model="numpy")(scales))


def of_motion(act: Callable[..., Any], values: Sequence[float]) -> Scales:
    """A form over displacement and velocity, as factors over displacement, velocity and energy."""
    form, fixed = numba.njit(nogil=True, error_model="numpy")(act), tuple(values)

    def scales(x: float, velocity: float, energy: float) -> tuple[float, float, float]:
        a, b, c = form(x, velocity, *fixed)
        return float(a), float(b), float(c)

    return cast(Scales, numba.njit(_SCALES, nogil=True, error_model="numpy")(scales))


def product_of(functions: Sequence[Scales]) -> Scales:
    """The product of factors; nothing leaves the law as it is."""
    return reduce(_times, functions) if functions else unscaled


def _times(one: Scales, other: Scales) -> Scales:
    def both(x: float, velocity: float, energy: float) -> tuple[float, float, float]:
        a, b, c = one(x, velocity, energy)
        d, e, f = other(x, velocity, energy)
        return a * d, b * e, c * f

    return cast(Scales, numba.njit(_SCALES, nogil=True, error_model="numpy")(both))


def chain_of(functions: Sequence[OfTwo]) -> OfTwo:
    """Compiled functions one after another in their first argument; the second is the same for all."""
    return reduce(_after, functions) if functions else first


def _after(one: OfTwo, other: OfTwo) -> OfTwo:
    def chained(value: float, second: float) -> float:
        return other(one(value, second), second)

    return cast(OfTwo, numba.njit(_OF_TWO, nogil=True, error_model="numpy")(chained))


def sum_of(functions: Sequence[OfFour]) -> OfFour:
    """The sum of compiled functions of the same four arguments; nothing adds up to zero."""
    return reduce(_plus, functions) if functions else no_force


def _plus(one: OfFour, other: OfFour) -> OfFour:
    def both(first: float, second: float, third: float, fourth: float) -> float:
        return one(first, second, third, fourth) + other(first, second, third, fourth)

    return cast(OfFour, numba.njit(_OF_FOUR, nogil=True, error_model="numpy")(both))


def _nothing(first: float, second: float) -> float:
    return 0.0


def _no_force(x: float, velocity: float, bent: float, followed: float) -> float:
    return 0.0


def _first(first: float, second: float) -> float:
    return first


def _unscaled(x: float, velocity: float, energy: float) -> tuple[float, float, float]:
    return 1.0, 1.0, 1.0


def _second(first: float, second: float) -> float:
    return second


nothing: OfTwo = compiled(_nothing, _OF_TWO)
"""Iron that remembers nothing."""
no_force: OfFour = compiled(_no_force, _OF_FOUR)
"""No force beside the law."""
rigid: OfTwo = compiled(_second, _OF_TWO)
"""A mounting without play: the damper is where the actuator is."""
first: OfTwo = compiled(_first, _OF_TWO)
"""A field that the damper sees as it is."""
unscaled: Scales = compiled(_unscaled, _SCALES)
"""A law that nothing scales."""

"""Array type of the simulated rig, and the only place where functions are compiled."""

import hashlib
import os
from collections.abc import Callable, Sequence
from functools import reduce
from pathlib import Path
from typing import Any, TypeAlias, TypeVar, cast

import numba
import numpy as np
import numpy.typing as npt
from numba.core import cgutils
from numba.extending import intrinsic
from platformdirs import user_cache_dir

_SOURCE_FOLDERS = ("sim_rig", "identification/damper")
"""Folders whose sources enter the machine code: a change in any of them invalidates all of it."""


def _configure_cache() -> None:
    """Use one cache folder per state of the sources, as numba does not notice a change in a called function."""
    top, digest = Path(__file__).parents[2], hashlib.sha256()
    for source in sorted(path for folder in _SOURCE_FOLDERS for path in (top / folder).rglob("*.py")):
        digest.update(source.read_bytes())
    cache = Path(os.environ.get("MRBENCH_CACHE") or user_cache_dir("mrbench")).resolve()
    folder = cache / "compiled" / f"rig-{digest.hexdigest()[:16]}"
    numba.config.CACHE_DIR = str(folder)  # type: ignore[attr-defined]  # made by numba when it is imported


_configure_cache()

Array: TypeAlias = npt.NDArray[np.float64]
"""Real numbers in SI units; the docstring of each use gives shape and unit."""

BinaryFunction: TypeAlias = Callable[[float, float], float]
"""A compiled function of two numbers, passed to the plant as an argument."""

TernaryFunction: TypeAlias = Callable[[float, float, float], float]
"""A compiled function of three numbers, passed to the plant as an argument."""

QuaternaryFunction: TypeAlias = Callable[[float, float, float, float], float]
"""A compiled function of four numbers, passed to the plant as an argument."""

ScaleFunction: TypeAlias = Callable[[float, float, float], tuple[float, float, float]]
"""A compiled function of displacement [m], velocity [m/s] and energy [J]: factors of alpha, c0 and c1."""

Function = TypeVar("Function", bound=Callable[..., object])

_BINARY_SIGNATURE = numba.float64(numba.float64, numba.float64)
BINARY_TYPE = numba.types.FunctionType(_BINARY_SIGNATURE)
"""Type of ``BinaryFunction`` in explicit signatures: one compiled plant then takes any of them."""
_TERNARY_SIGNATURE = numba.float64(numba.float64, numba.float64, numba.float64)
TERNARY_TYPE = numba.types.FunctionType(_TERNARY_SIGNATURE)
"""Type of ``TernaryFunction``."""
_QUATERNARY_SIGNATURE = numba.float64(numba.float64, numba.float64, numba.float64, numba.float64)
QUATERNARY_TYPE = numba.types.FunctionType(_QUATERNARY_SIGNATURE)
"""Type of ``QuaternaryFunction``."""
_TRIPLE = numba.types.UniTuple(numba.float64, 3)  # type: ignore[no-untyped-call]
_SCALE_SIGNATURE = _TRIPLE(numba.float64, numba.float64, numba.float64)
SCALE_TYPE = numba.types.FunctionType(_SCALE_SIGNATURE)
"""Type of ``ScaleFunction``."""


def compile_function(function: Function, signature: Any = None, *, brief: bool = False) -> Function:
    """Return the function as machine code, cached on disk between processes.

    With a signature it is compiled at once for that signature only, otherwise at its first call. It releases the
    interpreter's lock, unless it is ``brief``: a thread that has to wait for the lock again loses more time than a
    few microseconds of work give to the others.
    """
    # By numpy's rules a division by zero gives infinity instead of an exception; the integrators check for it.
    return cast(Function, numba.njit(signature, cache=True, nogil=not brief, error_model="numpy")(function))


def compile_inline(function: Function) -> Function:
    """Compile a small function that is inlined into its callers: passing arrays costs more than it computes."""
    return cast(Function, numba.njit(cache=True, nogil=True, error_model="numpy", forceinline=True)(function))


def _borrow(typing_context: Any, array: Any) -> Any:
    def make_view(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        make_struct = cgutils.create_struct_proxy(signature.return_type)  # type: ignore[no-untyped-call]
        view = make_struct(context, builder, value=arguments[0])
        view.meminfo = cgutils.get_null_value(view.meminfo.type)  # type: ignore[no-untyped-call]
        return view._getvalue()  # noqa: SLF001  # the accessor that extensions of numba use

    return array(array), make_view


borrow = cast(Callable[[Any], Any], intrinsic(_borrow))
"""Return an array on the same memory that counts no references, for compiled code only.

Otherwise every slice and every call by an address counts them, which takes longer than an effect's form. The
memory must belong to an argument of the function that is called from Python: nothing else keeps it alive.
"""


def _compile_uncached(function: Function, signature: Any = None) -> Function:
    """Return the function as machine code of this process only: a closure over values cannot be cached."""
    return cast(Function, numba.njit(signature, nogil=True, error_model="numpy")(function))


class FixedAddress:
    """A compiled function with a fixed address; numba looks those of other arguments up at each call."""

    def __init__(self, function: Any, kind: Any) -> None:
        """Find the address of a function of a type, such as `BINARY_TYPE`."""
        self._function, self._numba_type_ = function, kind
        compiled = function.get_compile_result(kind.signature)
        self._address = int(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_cfunc_wrapper_name))

    def __call__(self, *arguments: float) -> Any:
        """Call the function."""
        return self._function(*arguments)

    def __wrapper_address__(self) -> int:
        """Return the address; numba asks for it by this name."""
        return self._address


def bind_values(function: Callable[..., Any], values: Sequence[float]) -> BinaryFunction:
    """Fix the parameters of a form of two numbers."""
    form, fixed = _compile_uncached(function), tuple(values)

    def bound(first: float, second: float) -> float:
        return float(form(first, second, *fixed))

    return _compile_uncached(bound, _BINARY_SIGNATURE)


def bind_memory(function: Callable[..., Any], values: Sequence[float]) -> TernaryFunction:
    """Fix the parameters of the memory of a field: over the last memory, the change of the field, its position."""
    form, fixed = _compile_uncached(function), tuple(values)

    def bound(memory: float, change: float, position: float) -> float:
        return float(form(memory, change, position, *fixed))

    return _compile_uncached(bound, _TERNARY_SIGNATURE)


def bind_first(function: Callable[..., Any], values: Sequence[float]) -> BinaryFunction:
    """Fix the parameters of a form of one number; the second argument is ignored."""
    form, fixed = _compile_uncached(function), tuple(values)

    def bound(first: float, second: float) -> float:
        return float(form(first, *fixed))

    return _compile_uncached(bound, _BINARY_SIGNATURE)


def bind_first_two(function: Callable[..., Any], values: Sequence[float]) -> QuaternaryFunction:
    """Fix the parameters of a form of two numbers; the last two arguments are ignored."""
    form, fixed = _compile_uncached(function), tuple(values)

    def bound(first: float, second: float, third: float, fourth: float) -> float:
        return float(form(first, second, *fixed))

    return _compile_uncached(bound, _QUATERNARY_SIGNATURE)


def bind_first_three(function: Callable[..., Any], values: Sequence[float]) -> QuaternaryFunction:
    """Fix the parameters of a form of three numbers; the fourth argument is ignored."""
    form, fixed = _compile_uncached(function), tuple(values)

    def bound(first: float, second: float, third: float, fourth: float) -> float:
        return float(form(first, second, third, *fixed))

    return _compile_uncached(bound, _QUATERNARY_SIGNATURE)


def bind_all_but_third(function: Callable[..., Any], values: Sequence[float]) -> QuaternaryFunction:
    """Fix the parameters of a form of three numbers; the third of four arguments is ignored."""
    form, fixed = _compile_uncached(function), tuple(values)

    def bound(first: float, second: float, third: float, fourth: float) -> float:
        return float(form(first, second, fourth, *fixed))

    return _compile_uncached(bound, _QUATERNARY_SIGNATURE)


def bind_energy(function: Callable[..., Any], values: Sequence[float]) -> ScaleFunction:
    """Fix the parameters of scale factors over the energy; displacement and velocity are ignored."""
    form, fixed = _compile_uncached(function), tuple(values)

    def bound(x: float, velocity: float, energy: float) -> tuple[float, float, float]:
        a, b, c = form(energy, *fixed)
        return float(a), float(b), float(c)

    return _compile_uncached(bound, _SCALE_SIGNATURE)


def bind_motion(function: Callable[..., Any], values: Sequence[float]) -> ScaleFunction:
    """Fix the parameters of scale factors over displacement and velocity; the energy is ignored."""
    form, fixed = _compile_uncached(function), tuple(values)

    def bound(x: float, velocity: float, energy: float) -> tuple[float, float, float]:
        a, b, c = form(x, velocity, *fixed)
        return float(a), float(b), float(c)

    return _compile_uncached(bound, _SCALE_SIGNATURE)


def multiply_functions(functions: Sequence[ScaleFunction]) -> ScaleFunction:
    """Return the product of scale factors; without functions, factors of one."""
    return reduce(_multiply_pair, functions) if functions else unit_scale


def _multiply_pair(one: ScaleFunction, other: ScaleFunction) -> ScaleFunction:
    def product(x: float, velocity: float, energy: float) -> tuple[float, float, float]:
        a, b, c = one(x, velocity, energy)
        d, e, f = other(x, velocity, energy)
        return a * d, b * e, c * f

    return _compile_uncached(product, _SCALE_SIGNATURE)


def compose_functions(functions: Sequence[BinaryFunction]) -> BinaryFunction:
    """Return the composition of functions in their first argument; the second is the same for all."""
    return reduce(_compose_pair, functions) if functions else identity


def _compose_pair(one: BinaryFunction, other: BinaryFunction) -> BinaryFunction:
    def composed(value: float, second: float) -> float:
        return other(one(value, second), second)

    return _compile_uncached(composed, _BINARY_SIGNATURE)


def add_functions(functions: Sequence[QuaternaryFunction]) -> QuaternaryFunction:
    """Return the sum of functions; without functions, zero."""
    return reduce(_add_pair, functions) if functions else no_force


def _add_pair(one: QuaternaryFunction, other: QuaternaryFunction) -> QuaternaryFunction:
    def total(first: float, second: float, third: float, fourth: float) -> float:
        return one(first, second, third, fourth) + other(first, second, third, fourth)

    return _compile_uncached(total, _QUATERNARY_SIGNATURE)


def _return_zero_memory(first: float, second: float, third: float) -> float:
    return 0.0


def _return_zero_force(x: float, velocity: float, lip_bend: float, gas_position: float) -> float:
    return 0.0


def _return_first(first: float, second: float) -> float:
    return first


def _return_unit_scale(x: float, velocity: float, energy: float) -> tuple[float, float, float]:
    return 1.0, 1.0, 1.0


def _return_second(first: float, second: float) -> float:
    return second


no_memory: TernaryFunction = compile_function(_return_zero_memory, _TERNARY_SIGNATURE)
"""Iron without remanence."""
no_force: QuaternaryFunction = compile_function(_return_zero_force, _QUATERNARY_SIGNATURE)
"""No parallel force."""
rigid_mounting: BinaryFunction = compile_function(_return_second, _BINARY_SIGNATURE)
"""A mounting without backlash: the damper has the displacement of the actuator."""
identity: BinaryFunction = compile_function(_return_first, _BINARY_SIGNATURE)
"""A field without saturation or remanence."""
unit_scale: ScaleFunction = compile_function(_return_unit_scale, _SCALE_SIGNATURE)
"""Scale factors of one."""

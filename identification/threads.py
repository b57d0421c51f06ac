"""Linear algebra on a single thread.

The matrices here are long and thin. More threads would only wait for each other, at full power consumption.
"""

from contextlib import AbstractContextManager
from functools import cache

import scipy.linalg  # noqa: F401  (loads the library that is to be limited)
from threadpoolctl import ThreadpoolController


@cache
def _find_libraries() -> ThreadpoolController:
    """Return the loaded libraries, searched once because the search takes as long as a step of a fit."""
    return ThreadpoolController()


def use_one_thread() -> AbstractContextManager[object]:
    """Return a context in which the libraries of linear algebra use one thread."""
    context: AbstractContextManager[object] = _find_libraries().limit(limits=1, user_api="blas")
    return context

"""Linear algebra on one thread.

The matrices here are long and thin: more threads only wait for each other, at full power.
"""

from contextlib import AbstractContextManager
from functools import cache

import scipy.linalg  # noqa: F401  (its library must be loaded to be found)
from threadpoolctl import ThreadpoolController


@cache
def _libraries() -> ThreadpoolController:
    """What is loaded, looked for once: that takes as long as a step of a fit."""
    return ThreadpoolController()


def one_thread() -> AbstractContextManager[object]:
    """A context in which the libraries of linear algebra use one thread."""
    limited: AbstractContextManager[object] = _libraries().limit(limits=1, user_api="blas")
    return limited

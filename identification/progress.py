"""Progress of a computation, shown on a terminal."""

import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeAlias

Progress: TypeAlias = Callable[[str, float], None]
"""Receives a message and the present force error [N], which is not finite while there is none."""


def ignore_progress(message: str, error: float) -> None:
    """Discard a progress report."""


@contextmanager
def show_progress(title: str) -> Iterator[Progress]:
    """Yield a progress callback that updates one line on standard error, or does nothing without a terminal."""
    # Imported here because every fit imports this module and only commands need a console.
    from rich.console import Console

    console = Console(file=sys.stderr)
    if not console.is_terminal:
        yield ignore_progress
        return
    with console.status(title) as status:
        yield lambda message, error: status.update(f"{title}: {message}{_describe_force_error(error)}")


def _describe_force_error(error: float) -> str:
    return f", force error {error:.3g} N" if math.isfinite(error) else ""

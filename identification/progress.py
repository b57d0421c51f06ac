"""Progress of a fit, on a terminal only."""

import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console


@contextmanager
def progress_on_terminal(title: str) -> Iterator[Callable[[str, float], None]]:
    """A live line with the force error [N] on standard error; silent where that is no terminal."""
    console = Console(file=sys.stderr)
    if not console.is_terminal:
        yield lambda what, error: None
        return
    with console.status(title) as status:
        yield lambda what, error: status.update(f"{title}: {what}{_force_error(error)}")


def _force_error(error: float) -> str:
    """The force error [N] in words, once there is one."""
    return f", force error {error:.3g} N" if math.isfinite(error) else ""

"""Progress callback, and a progress bar on standard error."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeAlias

Progress: TypeAlias = Callable[[float], None]
"""Callback that receives the completed share, 0 to 1."""


@contextmanager
def show_progress(label: str) -> Iterator[Progress]:
    """Show a progress bar from 0 to 1 while the context lasts; silent if standard error is not a terminal."""
    from rich import progress as rich_progress
    from rich.console import Console

    console = Console(stderr=True)
    with rich_progress.Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(label, total=1.0)
        yield lambda share: bar.update(task, completed=share)

"""Progress bars on standard error, if it is a terminal."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def show_progress_bars() -> Iterator[Callable[[str, float], None]]:
    """Show one bar per task name, from 0 to 1; show nothing if standard error is not a terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bars:
        tasks: dict[str, object] = {}

        def show(task: str, fraction: float) -> None:
            if task not in tasks:
                tasks[task] = bars.add_task(task, total=100)
            bars.update(tasks[task], completed=round(100 * fraction))  # type: ignore[arg-type]  # rich's own id

        yield show

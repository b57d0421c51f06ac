"""Progress of a computation, shown on a terminal, or as lines for a program that started the command."""

import json
import math
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import TypeAlias

Progress: TypeAlias = Callable[[str, float], None]
"""Receives a message and the present force error [N], which is not finite while there is none."""
_LINE_PERIOD = 1.0
"""Shortest time between two lines of the same stage [s]."""


def ignore_progress(message: str, error: float) -> None:
    """Discard a progress report."""


@dataclass
class LineWriter:
    """Writer of progress as JSON lines on standard error: stage, completed share, message."""

    stage: str = ""
    written: float = field(default=-math.inf)
    """Time of the last line [s]."""

    def write(self, stage: str, fraction: float, message: str) -> None:
        """Write a line, unless one of this stage was written just before."""
        now = time.monotonic()
        if stage == self.stage and now - self.written < _LINE_PERIOD:
            return
        self.stage, self.written = stage, now
        line = json.dumps({"stage": stage, "fraction": round(fraction, 3), "message": message})
        print(line, file=sys.stderr, flush=True)  # noqa: T201 - the program that started this command reads it


@dataclass(frozen=True)
class StageProgress:
    """Progress callback that knows its stage, and the part of the whole work which that is."""

    write: Callable[[str, float, str], None]
    """Receives stage, completed share of the whole, 0 to 1, and message."""
    stage: str = "read"
    first: float = 0.0
    """Completed share at the start of the stage."""
    last: float = 1.0
    """Completed share at its end."""

    def __call__(self, message: str, error: float) -> None:
        """Report an activity within the stage."""
        parts = ("" if message == self.stage else message, _describe_force_error(error))
        self.write(self.stage, self.first, ", ".join(part for part in parts if part))


def enter_stage(progress: Progress, stage: str, number: int, count: int) -> Progress:
    """Return the progress callback of a stage, and report its start.

    Args:
        progress: callback of the whole work.
        stage: name of the stage.
        number: number of stages before this one.
        count: number of all stages; each counts as the same share.
    """
    if not isinstance(progress, StageProgress):
        return progress
    entered = replace(progress, stage=stage, first=number / count, last=(number + 1) / count)
    entered(stage, math.nan)
    return entered


def advance(progress: Progress, share: float) -> Progress:
    """Return the progress callback of a stage of which a share is completed, 0 to 1."""
    if not isinstance(progress, StageProgress):
        return progress
    return replace(progress, first=progress.first + min(share, 1.0) * (progress.last - progress.first))


@contextmanager
def show_progress(title: str) -> Iterator[Progress]:
    """Yield a progress callback that updates one line on standard error.

    Without a terminal nothing is shown, unless ``MRBENCH_PROGRESS=json`` asks for JSON lines.
    """
    if os.environ.get("MRBENCH_PROGRESS") == "json":
        progress = StageProgress(LineWriter().write)
        progress(progress.stage, math.nan)
        yield progress
        return
    # Imported here because every fit imports this module and only commands need a console.
    from rich.console import Console

    console = Console(file=sys.stderr)
    if not console.is_terminal:
        yield ignore_progress
        return
    with console.status(title) as status:
        yield lambda message, error: status.update(
            ", ".join(part for part in (f"{title}: {message}", _describe_force_error(error)) if part)
        )


def _describe_force_error(error: float) -> str:
    return f"force error {error:.3g} N" if math.isfinite(error) else ""

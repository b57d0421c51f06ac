"""Who watches a training: progress, the wish to stop, a budget of processor time."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field

Progress = Callable[[str, float], None]
"""Told what is being done and the force error so far [N]."""


class Stopped(Exception):  # noqa: N818 - reads as the sentence it makes; never leaves the room
    """Training was asked to stop, or its budget ended."""


@dataclass(frozen=True)
class Supervision:
    """Asked between the steps of a training."""

    progress: Progress = lambda what, error: None
    stop: Callable[[], bool] = lambda: False
    """True once somebody wants no more."""
    budget: float | None = None
    """[s] of processor time; None for as long as it takes."""
    began: float = field(default_factory=time.process_time)

    @property
    def seconds(self) -> float:
        """[s] of processor time since the start."""
        return time.process_time() - self.began

    def step(self, what: str, error: float) -> None:
        """Say where the training stands.

        Raises:
            Stopped: nobody wants more, or the budget is spent.
        """
        self.progress(what, error)
        if self.stop():
            raise Stopped("stopped on request")
        if self.budget is not None and self.seconds > self.budget:
            raise Stopped(f"its budget of {self.budget:.3g} s of processor time ended")

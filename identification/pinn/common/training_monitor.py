"""Monitor of a training: progress reports, stop requests and a budget of processor time."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field

from identification.progress import Progress, ignore_progress


class TrainingStopped(Exception):  # noqa: N818 - a request of the caller, not an error; callers of the network catch it
    """Training was asked to stop, or its budget was spent."""


@dataclass(frozen=True)
class TrainingMonitor:
    """Receives a report after each step of a training, and ends the training on request."""

    progress: Progress = ignore_progress
    should_stop: Callable[[], bool] = lambda: False
    """Returns True once the training shall end."""
    budget: float | None = None
    """Limit of the processor time [s]; None for no limit."""
    start_time: float = field(default_factory=time.process_time)

    @property
    def seconds(self) -> float:
        """Processor time [s] since the start."""
        return time.process_time() - self.start_time

    def report(self, message: str, error: float) -> None:
        """Report a step of the training and the force error so far [N].

        Raises:
            TrainingStopped: a stop was requested, or the budget is spent.
        """
        self.progress(message, error)
        if self.should_stop():
            raise TrainingStopped("stopped on request")
        if self.budget is not None and self.seconds > self.budget:
            raise TrainingStopped(f"its budget of {self.budget:.3g} s of processor time ended")

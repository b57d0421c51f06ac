"""Monitor of a training: progress reports, stop requests and a budget."""

from collections.abc import Callable
from dataclasses import dataclass, field

from identification.fitting import Budget, EffortMeter
from identification.progress import Progress, ignore_progress


class TrainingStopped(Exception):  # noqa: N818 - a request of the caller, not an error; callers of the network catch it
    """Training was asked to stop, or its budget was spent."""


@dataclass(frozen=True)
class TrainingMonitor:
    """Receives a report after each step of a training, and ends the training on request."""

    progress: Progress = ignore_progress
    should_stop: Callable[[], bool] = lambda: False
    """Returns True once the training shall end."""
    budget: Budget = field(default_factory=Budget)
    _meter: EffortMeter = field(init=False)

    def __post_init__(self) -> None:
        """Start the meter."""
        object.__setattr__(self, "_meter", EffortMeter(self.budget, self.progress))

    @property
    def seconds(self) -> float:
        """Processor time [s] since the start."""
        return self._meter.seconds

    def report(self, message: str, error: float) -> None:
        """Report a step of the training and the force error so far [N].

        Raises:
            TrainingStopped: a stop was requested, or the budget is spent.
        """
        self._meter.report(message, error)
        if self.should_stop():
            raise TrainingStopped("stopped on request")
        if self._meter.is_spent:
            raise TrainingStopped(f"its budget of {self.budget.describe()} ended")

"""Budget of a fit: steps, with the same result on every machine, or processor time, with another one."""

import re
import time
from dataclasses import dataclass, field, replace

from identification.errors import IdentificationError
from identification.progress import Progress, ignore_progress

_SECONDS = re.compile(r"(\d+(?:\.\d+)?)s")


@dataclass(frozen=True)
class Budget:
    """Limit on the effort of a fit; without either limit it never ends one."""

    steps: int | None = None
    """Largest number of steps of each stage."""
    seconds: float | None = None
    """Processor time of all stages [s]; the result then depends on the machine and on its load."""

    @staticmethod
    def from_text(text: str) -> "Budget":
        """Return a budget from text: ``500`` is a number of steps, ``60s`` a processor time, empty is no limit.

        Raises:
            IdentificationError: the text is neither, or the budget is zero.
        """
        match = _SECONDS.fullmatch(text)
        if not text:
            return Budget()
        if match and float(match[1]) > 0.0:
            return Budget(seconds=float(match[1]))
        if text.isdecimal() and int(text) > 0:
            return Budget(steps=int(text))
        raise IdentificationError(
            f"--budget {text}: give a number of steps such as `500`, or a processor time such as `60s`"
        )

    def __str__(self) -> str:
        """Return the text of this budget; empty without a limit."""
        if self.seconds is not None:
            return f"{self.seconds:g}s"
        return "" if self.steps is None else str(self.steps)

    def describe(self) -> str:
        """Return the budget for a message."""
        if self.seconds is not None:
            return f"{self.seconds:.3g} s of processor time"
        return "no limit" if self.steps is None else f"{self.steps} steps"

    def scale(self, factor: float) -> "Budget":
        """Return the budget with another processor time; the steps are those of each stage and stay."""
        return self if self.seconds is None else replace(self, seconds=factor * self.seconds)

    def is_spent(self, steps: int, seconds: float) -> bool:
        """Return whether a number of steps or a processor time [s] reaches the limit."""
        late = self.seconds is not None and seconds > self.seconds
        return late or (self.steps is not None and steps >= self.steps)


@dataclass
class EffortMeter:
    """Steps and processor time since its start, compared with a budget."""

    budget: Budget = field(default_factory=Budget)
    progress: Progress = ignore_progress
    """Receives every report."""
    steps: int = 0
    """Number of reports."""
    start_time: float = field(default_factory=time.process_time)

    @property
    def seconds(self) -> float:
        """Processor time [s] since the start."""
        return time.process_time() - self.start_time

    @property
    def is_spent(self) -> bool:
        """Return whether the budget is spent."""
        return self.budget.is_spent(self.steps, self.seconds)

    def report(self, message: str, error: float) -> None:
        """Count a step, and report it with the force error so far [N]."""
        self.steps += 1
        self.progress(message, error)

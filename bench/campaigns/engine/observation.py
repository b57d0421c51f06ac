"""Observations of a bench, as the state machine takes them."""

from typing import Literal, TypeAlias

from pydantic import Field

from bench.campaigns.engine.state import RunResult
from bench.validation import FrozenModel

ReportKind: TypeAlias = Literal["absent", "refused", "running", "ended", "crashed"]
"""absent: never begun; crashed: the bench ended in the middle of it, or its log has no end."""


class ExecutionReport(FrozenModel):
    """State of the requested run."""

    kind: ReportKind
    run: str = ""
    """Id of the run; empty if it has none."""
    outcome: str = ""
    """clean, lossy or incomplete."""
    ending: str = ""
    """completed, stopped, aborted or tripped."""
    reason: str = ""
    duration_s: float = 0.0
    """Recorded time [s]."""
    checkpoint: str = ""
    """Last checkpoint that an incomplete run has passed; empty without one."""
    has_samples: bool = True
    """False if its log is missing or contains no sample, so that no other run can continue it."""


class Observation(FrozenModel):
    """State of the bench at one moment."""

    report: ExecutionReport | None = None
    """Report on the active execution; None if it is not known."""
    temperature_c: float | None = None
    """Present reading of the thermometer; None without one."""
    results: dict[str, RunResult] = Field(default_factory=dict)
    """New results by the id of their run."""
    obstacle: str = ""
    """Reason why nothing can be started; empty if the bench is ready."""

"""States of runs and jobs in the answers of the service."""

from datetime import datetime
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from bench.client.errors import ClientError
from bench.validation import describe_validation_error

State = TypeVar("State", bound=BaseModel)
_UNFINISHED_JOBS = ("queued", "running")
_IDENTIFIED_OUTCOMES = ("clean", "lossy")
"""Outcomes of a run of the bench that the service identifies by itself."""


class JobState(BaseModel):
    """Job of a run; the service may send further fields."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    id: str
    kind: str
    run: str = ""
    """Id of the run."""
    state: str
    """queued, running, done, failed or cancelled."""
    attempts: int = 0
    """Number of starts by a worker."""
    error: str = ""
    """Reason of a failure."""

    @property
    def is_finished(self) -> bool:
        """Return whether the job is done, failed or cancelled."""
        return self.state not in _UNFINISHED_JOBS


class RunState(BaseModel):
    """State of a run when it was requested; the service may send further fields."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    id: str
    method: str
    specimen: str
    operator: str
    bench: str | None = None
    """Name of the bench in the service; None in runs of older versions and in imports."""
    source: str = "run"
    """run for a run of the bench, import for a recording made elsewhere."""
    state: str
    """running, ended or truncated."""
    ending: str | None = None
    """completed, stopped, aborted or tripped; None while it is running or if unknown."""
    outcome: str | None = None
    """State of the log: clean, lossy, truncated or incomplete."""
    reason: str = ""
    started: datetime | None = None
    """UTC."""
    duration_s: float | None = None
    """Planned or recorded duration [s]."""
    rmse_n: float | None = None
    """Force error of the newest fit [N]."""
    noise_floor_n: float | None = None
    """Noise floor of the force [N]."""
    jobs: tuple[JobState, ...] = ()

    @property
    def is_evaluated(self) -> bool:
        """Return whether the run has ended and all its jobs are finished.

        The service queues the identification of a run shortly after its end, so a run without jobs may await it.
        """
        awaits_job = self.source == "run" and self.outcome in _IDENTIFIED_OUTCOMES and not self.jobs
        return self.state != "running" and not awaits_job and all(job.is_finished for job in self.jobs)


def parse_job_state(content: Any) -> JobState:
    """Return the state in a reply of the service.

    Raises:
        ClientError: it is not the state of a job.
    """
    return _parse(content, JobState, "job")


def parse_run_state(content: Any) -> RunState:
    """Return the state in a reply of the service.

    Raises:
        ClientError: it is not the state of a run.
    """
    return _parse(content, RunState, "run")


def _parse(content: Any, kind: type[State], name: str) -> State:
    try:
        return kind.model_validate(content)
    except ValidationError as error:
        reason = describe_validation_error(error, f"the {name}")
        raise ClientError(
            f"the reply is not a {name} ({reason}); use a client of the service's version"
        ) from error

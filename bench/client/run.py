"""One run of the service."""

import time
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError

from bench.client.arrays import Arrays, make_arrays
from bench.client.errors import ClientError
from bench.client.session import STOP_TIMEOUT, Session, quote_name
from bench.client.signed_reports import SignedReports
from bench.validation import describe_validation_error

_POLL_PERIOD = 0.5
"""Time [s] between two requests while a script waits."""
_UNFINISHED_JOBS = ("queued", "running")
_IDENTIFIED_OUTCOMES = ("clean", "lossy")
"""Outcomes of a run of the bench that the service identifies by itself."""


class JobState(BaseModel):
    """Job of a run; the service may send further fields."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    id: str
    kind: str
    state: str
    error: str = ""

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


class Run(SignedReports):
    """One run; each call requests its present state.

    Args:
        session: session with the service.
        run_id: id of the run.
    """

    def __init__(self, session: Session, run_id: str) -> None:
        self.id = run_id
        super().__init__(session, f"/runs/{quote_name(run_id)}")

    def __repr__(self) -> str:
        return f"Run({self.id!r})"

    def get_state(self) -> RunState:
        """Return the present state.

        Raises:
            ClientError: there is no such run, or the service cannot be reached.
        """
        return parse_run_state(self._session.get(self._path))

    def wait(self, timeout: float = 3600.0) -> RunState:
        """Wait for the end of the run and return its state.

        Args:
            timeout: longest time to wait [s].

        Raises:
            ClientError: the run has not ended in time, or the service cannot be reached.
        """
        return self._wait(lambda state: state.state != "running", timeout, "ended")

    def wait_for_jobs(self, timeout: float = 3600.0) -> RunState:
        """Wait until the run has ended and none of its jobs is unfinished; return its state.

        Args:
            timeout: longest time to wait [s].

        Raises:
            ClientError: a job is not finished in time, or the service cannot be reached.
        """
        return self._wait(lambda state: state.is_evaluated, timeout, "been evaluated")

    def arrays(
        self, *channels: str, start_s: float | None = None, stop_s: float | None = None, points: int = 0
    ) -> Arrays:
        """Return samples, each channel of shape (samples,) with its unit, to the accuracy of 32-bit numbers.

        Args:
            channels: names of the channels; all by default.
            start_s: first time since the start of the run [s].
            stop_s: last time since the start of the run [s].
            points: number of intervals of which only the extremes are returned; 0 for all samples.

        Raises:
            ClientError: the log is missing, truncated or not complete yet, a channel is unknown, or the service
                cannot be reached.
        """
        query = {"channel": channels or None, "from": start_s, "to": stop_s, "points": points}
        content, listed = self._session.get_batches(f"{self._path}/samples", format="float32", **query)
        return make_arrays(content, listed)

    def fit(self) -> dict[str, Any]:
        """Return the newest fit, `mrbench.fit/1`.

        Raises:
            ClientError: there is none, or the service cannot be reached.
        """
        return dict(self._session.get(f"{self._path}/fit"))

    def download_log(self, to: Path) -> Path:
        """Download the log (MCAP) and return its path.

        Raises:
            ClientError: the log is not available, or the download breaks off.
            LogError: the file cannot be written.
        """
        return self._session.download(f"{self._path}/log", to)

    def download_report(self, to: Path) -> Path:
        """Download the report (HTML) and return its path.

        Raises:
            ClientError: the report is not available, or the download breaks off.
            LogError: the file cannot be written.
        """
        return self._session.download(f"{self._path}/report", to)

    def stop(self) -> None:
        """Stop the run in a controlled way: the motion fades out, the coil goes to zero.

        Raises:
            ClientError: another run is in progress, or the service or its agent cannot be reached.
        """
        self._session.post(f"{self._path}/stop", timeout=STOP_TIMEOUT)

    def _wait(self, is_reached: Callable[[RunState], bool], timeout: float, goal: str) -> RunState:
        deadline = time.monotonic() + timeout
        while not is_reached(state := self.get_state()):
            if time.monotonic() > deadline:
                raise ClientError(f"run {self.id} has not {goal} within {timeout:g} s; its state is {state.state}")
            time.sleep(_POLL_PERIOD)
        return state


def parse_run_state(content: Any) -> RunState:
    """Return the state in a reply of the service.

    Raises:
        ClientError: it is not the state of a run.
    """
    try:
        return RunState.model_validate(content)
    except ValidationError as error:
        reason = describe_validation_error(error, "the run")
        raise ClientError(f"the reply is not a run ({reason}); use a client of the service's version") from error

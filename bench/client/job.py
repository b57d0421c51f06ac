"""One job of the service."""

import uuid
from typing import Any

from bench.client.polling import wait_for_state
from bench.client.session import Session, quote_name
from bench.client.states import JobState, parse_job_state


class Job:
    """One identification, diagnosis or prediction; each call requests its present state.

    Args:
        session: session with the service.
        job_id: id of the job, as in `RunState.jobs`.
    """

    def __init__(self, session: Session, job_id: str) -> None:
        self.id = job_id
        self._session, self._path = session, f"/jobs/{quote_name(job_id)}"

    def __repr__(self) -> str:
        return f"Job({self.id!r})"

    def get_state(self) -> JobState:
        """Return the present state.

        Raises:
            ClientError: there is no such job, or the service cannot be reached.
        """
        return parse_job_state(self._session.get(self._path))

    def wait(self, timeout: float = 3600.0) -> JobState:
        """Wait until the job is done, failed or cancelled; return its state.

        Args:
            timeout: longest time to wait [s].

        Raises:
            ClientError: it is not finished in time, or the service cannot be reached.
        """
        return wait_for_state(
            self.get_state,
            lambda state: state.is_finished,
            timeout,
            lambda state: f"job {self.id} has not ended within {timeout:g} s; its state is {state.state}",
        )

    def cancel(self) -> JobState:
        """Cancel the job, and return its state; the work on it ends within a second.

        Raises:
            ClientError: the job has ended, or the service cannot be reached.
        """
        return parse_job_state(self._session.post(f"{self._path}/cancel"))

    def retry(self, reason: str) -> JobState:
        """Queue a failed or cancelled job again under its id, and return its state.

        Args:
            reason: reason of the repetition, kept with the job.

        Raises:
            ClientError: the job is not failed or cancelled, or the service cannot be reached.
        """
        return parse_job_state(self._session.post(f"{self._path}/retry", {"reason": reason}, key=uuid.uuid4().hex))

    def changes(self, since: str | None = None) -> dict[str, Any]:
        """Return what has changed in the result: answer, named effects, parameters.

        Args:
            since: id of the earlier job; by default that of the newest result of another version of mrbench.

        Raises:
            ClientError: one of both has no result, or the service cannot be reached.
        """
        return dict(self._session.get(f"{self._path}/changes", since=since))

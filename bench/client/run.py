"""One run of the service."""

import uuid
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from bench.client.arrays import Arrays, make_arrays
from bench.client.job import Job
from bench.client.polling import wait_for_state
from bench.client.session import STOP_TIMEOUT, Session, quote_name
from bench.client.signed_reports import SignedReports
from bench.client.states import RunState, parse_run_state
from bench.log import Format


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

    def diagnosis(self) -> dict[str, Any]:
        """Return the newest diagnosis, `mrbench.diagnosis/1`.

        Raises:
            ClientError: there is none, or the service cannot be reached.
        """
        return dict(self._session.get(f"{self._path}/diagnosis"))

    def identify(self, **settings: object) -> Job:
        """Request an identification, and return its job; an equal one that is done or unfinished is not repeated.

        Args:
            settings: as of `POST /runs/ID/identify`: stages, hold_out, hold_out_after, budget_s, time_limit_s.

        Raises:
            ClientError: a setting is refused, the log is not complete, or the service cannot be reached.
        """
        return self._request_job("identify", settings)

    def diagnose(self, **settings: object) -> Job:
        """Request a diagnosis, and return its job; an equal one that is done or unfinished is not repeated.

        Args:
            settings: as of `POST /runs/ID/diagnose`: hold_out, hold_out_after, discover, residual, model,
                time_limit_s.

        Raises:
            ClientError: a setting is refused, the log is not complete, or the service cannot be reached.
        """
        return self._request_job("diagnose", settings)

    def list_notes(self) -> list[dict[str, Any]]:
        """Return all notes, the oldest first; a change of the tags is a note, too.

        Raises:
            ClientError: there is no such run, or the service cannot be reached.
        """
        return list(self._iterate_notes())

    def add_note(self, text: str, author: str) -> dict[str, Any]:
        """Add a note, which is never changed, and return it.

        Args:
            text: text of the note.
            author: name of the person.

        Raises:
            ClientError: text or author is empty or too long, or the service cannot be reached.
        """
        request = {"author": author, "text": text}
        return dict(self._session.post(f"{self._path}/notes", request, key=uuid.uuid4().hex))

    def export(self, to: Path, file_format: Format | None = None) -> Path:
        """Download the samples for other tools, in SI units, and return the path of the file.

        Args:
            to: file to write.
            file_format: csv, parquet or mat; by default the ending of the file.

        Raises:
            ClientError: the log is not complete, there is no such format, or the download breaks off.
            LogError: the file cannot be written.
        """
        wanted = file_format or to.suffix.removeprefix(".")
        return self._session.download(f"{self._path}/export?format={quote_name(wanted)}", to)

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

    def abort(self) -> None:
        """Stop the run at once by the path of a trip, which latches until `Bench.reset`; harmless after its end.

        Raises:
            ClientError: another run is in progress, or the service or its agent cannot be reached.
        """
        self._session.post(f"{self._path}/abort", timeout=STOP_TIMEOUT)

    def pause(self) -> str:
        """End the run at its next checkpoint, at rest; return in words where this will be.

        Raises:
            ClientError: the run has ended, another one is in progress, or the service or its agent cannot be
                reached.
        """
        status = self._session.post(f"{self._path}/pause")
        return str((status["run"] or {}).get("pause", ""))

    def resume(self, after: str = "") -> "Run":
        """Start a run that continues this one after a checkpoint, and return the new run.

        Args:
            after: name of the checkpoint; by default the last one that was passed.

        Raises:
            ClientError: the run was completed or passed no checkpoint, the start is refused, or the service or its
                agent cannot be reached.
        """
        started = self._session.post(f"{self._path}/resume", {"after": after}, key=uuid.uuid4().hex)
        return Run(self._session, str(started["id"]))

    def _request_job(self, kind: str, settings: dict[str, object]) -> Job:
        job = self._session.post(f"{self._path}/{kind}", settings, key=uuid.uuid4().hex)
        return Job(self._session, str(job["id"]))

    def _iterate_notes(self) -> Iterator[dict[str, Any]]:
        after = None
        while True:
            page = self._session.get(f"{self._path}/notes", after=after)
            yield from page["items"]
            after = page["next"]
            if after is None:
                return

    def _wait(self, is_reached: Callable[[RunState], bool], timeout: float, goal: str) -> RunState:
        return wait_for_state(
            self.get_state,
            is_reached,
            timeout,
            lambda state: f"run {self.id} has not {goal} within {timeout:g} s; its state is {state.state}",
        )

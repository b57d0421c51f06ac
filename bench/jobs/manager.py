"""Job manager: keeps the state of jobs in the catalogue; the engine only executes them."""

import asyncio
import logging
import uuid
from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any

from bench.catalogue import UNFINISHED_STATES, Catalogue, JobRow, RunRow
from bench.jobs.engine import MAX_ATTEMPTS, JobEngine
from bench.jobs.job_spec import FitSummary, IdentifySettings, JobSpec, compute_content_key, get_result_folder

_LOG = logging.getLogger(__name__)


class JobManager:
    """Creates jobs, submits them to the engine, and records their states.

    A job that was unfinished when the service ended is submitted again under its key.
    """

    def __init__(self, catalogue: Catalogue, engine: JobEngine, on_changed: Callable[[JobRow], None]) -> None:
        """Use a catalogue and an engine; ``on_changed`` receives every changed job, in the event loop."""
        self._catalogue = catalogue
        self._engine = engine
        self._on_changed = on_changed

    async def identify(self, run: RunRow, settings: IdentifySettings) -> tuple[JobRow, bool]:
        """Create and submit the identification of a run, unless an equal job is unfinished or done.

        Args:
            run: an ended run with a complete log.
            settings: of the identification.

        Returns:
            The job, and whether it is new.
        """
        job = JobRow(
            id=uuid.uuid4().hex,
            run_id=run.id,
            key=compute_content_key(run.log_sha256 or "", settings),
            settings=settings.model_dump(mode="json"),
            state="queued",
            created=datetime.now(UTC),
            attempts=0,
        )
        row, is_new = await asyncio.to_thread(self._catalogue.add_job_once, job)
        if is_new:
            _LOG.info("job_queued", extra={"job": row.id, "run": run.id})
            self._on_changed(row)
            await self._submit(row)
        return row, is_new

    async def on_connected(self) -> None:
        """Submit all unfinished jobs."""
        for job in await asyncio.to_thread(self._catalogue.list_unfinished_jobs):
            _LOG.info("job_submitted_again", extra={"job": job.id, "run": job.run_id, "attempts": job.attempts})
            await self._submit(job)

    async def _submit(self, job: JobRow) -> None:
        run = await asyncio.to_thread(self._catalogue.get_run, job.run_id)
        if run is None:
            await self.on_failed(job.id, f"run {job.run_id} is no longer in the catalogue")
            return
        log = self._catalogue.resolve_path(run.log)
        spec = JobSpec(
            job_id=job.id,
            key=job.key,
            log=str(log),
            result=str(get_result_folder(log, job.key)),
            settings=IdentifySettings.model_validate(job.settings),
        )
        await self._engine.submit(spec)

    async def cancel(self, job: JobRow) -> JobRow:
        """Cancel a job: a queued one at once, a running one as soon as its worker has stopped it."""
        started = job.state == "running"
        if not started:
            # Recorded before the engine is called: a worker that starts it now no longer changes its state.
            await self.on_cancelled(job.id)
        await self._engine.cancel(job.id, started=started)
        return await asyncio.to_thread(self._catalogue.get_job, job.id) or job

    async def on_started(self, job_id: str) -> None:
        """Record that a worker started a job; fail a job that was started too often."""
        job = await asyncio.to_thread(self._catalogue.get_job, job_id)
        if job is None or job.state not in UNFINISHED_STATES:
            return
        if job.attempts >= MAX_ATTEMPTS:
            await self.on_failed(job_id, f"it was started {MAX_ATTEMPTS} times and never finished")
            await self._engine.cancel(job_id, started=True)
            return
        await self._update_job(
            job_id, state="running", attempts=job.attempts + 1, started=datetime.now(UTC), activity=""
        )

    async def on_progress(self, job_id: str, message: str) -> None:
        """Record the present activity of a job."""
        await self._update_job(job_id, activity=message)

    async def on_done(self, job_id: str, summary: FitSummary) -> None:
        """Record the result of a job; its files are next to the log."""
        job = await asyncio.to_thread(self._catalogue.get_job, job_id)
        run = await asyncio.to_thread(self._catalogue.get_run, job.run_id) if job else None
        if job is None or run is None:
            return
        folder = get_result_folder(self._catalogue.resolve_path(run.log), job.key)
        result = self._catalogue.make_name(folder)
        await self._finish_job(job_id, state="done", activity="", summary=summary, result=result)

    async def on_failed(self, job_id: str, reason: str) -> None:
        """Record the failure of a job."""
        await self._finish_job(job_id, state="failed", activity="", error=reason)

    async def on_cancelled(self, job_id: str) -> None:
        """Record that a job was cancelled."""
        await self._finish_job(job_id, state="cancelled", activity="")

    async def _finish_job(self, job_id: str, **values: Any) -> None:
        await self._update_job(job_id, finished=datetime.now(UTC), **values)

    async def _update_job(self, job_id: str, **values: Any) -> None:
        job = await asyncio.to_thread(lambda: self._catalogue.update_job(job_id, **values))
        if job is not None:
            if "state" in values:
                details = {"job": job_id, "run": job.run_id, "attempts": job.attempts, "error": job.error}
                _LOG.info(f"job_{job.state}", extra=details)
            self._on_changed(job)

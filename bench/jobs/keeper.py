"""Keeps the truth of jobs in the catalogue; the engine only carries them out."""

import asyncio
import logging
import uuid
from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any

from bench.catalogue.catalogue import Catalogue
from bench.catalogue.models import UNFINISHED, JobRow, RunRow
from bench.jobs.engine import MOST_ATTEMPTS, Engine
from bench.jobs.order import IdentifySettings, Order, Summary, content_key, result_folder

_LOG = logging.getLogger(__name__)


class JobKeeper:
    """Makes jobs, hands them to the engine, and writes down what becomes of them.

    A job that was not ended when the service ended is submitted again under its key, whatever the engine knows.
    """

    def __init__(self, catalogue: Catalogue, engine: Engine, notify: Callable[[JobRow], None]) -> None:
        """Take the catalogue, the engine, and whom to tell of a job that has changed; called in the event loop."""
        self._catalogue = catalogue
        self._engine = engine
        self._notify = notify

    async def identify(self, run: RunRow, settings: IdentifySettings) -> tuple[JobRow, bool]:
        """Have a run identified.

        Args:
            run: one that has ended, and whose log is whole.
            settings: how.

        Returns:
            The job, and whether it is new; what is done, or on its way, is not begun again.
        """
        job = JobRow(
            id=uuid.uuid4().hex,
            run_id=run.id,
            key=content_key(run.log_sha256 or "", settings),
            settings=settings.model_dump(mode="json"),
            state="queued",
            created=datetime.now(UTC),
            attempts=0,
        )
        found, new = await asyncio.to_thread(self._catalogue.add_job_once, job)
        if new:
            _LOG.info("job_queued", extra={"job": found.id, "run": run.id})
            self._notify(found)
            await self._submit(found)
        return found, new

    async def connected(self) -> None:
        """Submit everything unfinished."""
        for job in await asyncio.to_thread(self._catalogue.unfinished_jobs):
            _LOG.info("job_submitted_again", extra={"job": job.id, "run": job.run_id, "attempts": job.attempts})
            await self._submit(job)

    async def _submit(self, job: JobRow) -> None:
        run = await asyncio.to_thread(self._catalogue.run, job.run_id)
        if run is None:
            await self.failed(job.id, f"run {job.run_id} is not in the catalogue any more")
            return
        log = self._catalogue.path_of(run.log)
        order = Order(
            job_id=job.id,
            key=job.key,
            log=str(log),
            result=str(result_folder(log, job.key)),
            settings=IdentifySettings.model_validate(job.settings),
        )
        await self._engine.submit(order)

    async def cancel(self, job: JobRow) -> JobRow:
        """End a job: at once if nobody has begun it, otherwise as soon as its worker has stopped it."""
        began = job.state == "running"
        if not began:
            # Ended before the engine is told: a worker that begins it at this moment changes nothing any more.
            await self.cancelled(job.id)
        await self._engine.cancel(job.id, began=began)
        return await asyncio.to_thread(self._catalogue.job, job.id) or job

    async def began(self, job_id: str) -> None:
        """A worker has begun; one time too many is the last."""
        job = await asyncio.to_thread(self._catalogue.job, job_id)
        if job is None or job.state not in UNFINISHED:
            return
        if job.attempts >= MOST_ATTEMPTS:
            await self.failed(job_id, f"it was begun {MOST_ATTEMPTS} times and never ended")
            await self._engine.cancel(job_id, began=True)
            return
        await self._change(job_id, state="running", attempts=job.attempts + 1, started=datetime.now(UTC), doing="")

    async def says(self, job_id: str, words: str) -> None:
        """It says what it is doing."""
        await self._change(job_id, doing=words)

    async def done(self, job_id: str, summary: Summary) -> None:
        """It is done; its files stand beside the log."""
        job = await asyncio.to_thread(self._catalogue.job, job_id)
        run = await asyncio.to_thread(self._catalogue.run, job.run_id) if job else None
        if job is None or run is None:
            return
        folder = result_folder(self._catalogue.path_of(run.log), job.key)
        result = self._catalogue.name_of(folder)
        await self._end(job_id, state="done", doing="", summary=summary, result=result)

    async def failed(self, job_id: str, why: str) -> None:
        """It could not be done."""
        await self._end(job_id, state="failed", doing="", error=why)

    async def cancelled(self, job_id: str) -> None:
        """Its end was wanted."""
        await self._end(job_id, state="cancelled", doing="")

    async def _end(self, job_id: str, **values: Any) -> None:
        await self._change(job_id, finished=datetime.now(UTC), **values)

    async def _change(self, job_id: str, **values: Any) -> None:
        job = await asyncio.to_thread(lambda: self._catalogue.change_job(job_id, **values))
        if job is not None:
            if "state" in values:
                said = {"job": job_id, "run": job.run_id, "attempts": job.attempts, "error": job.error}
                _LOG.info(f"job_{job.state}", extra=said)
            self._notify(job)

"""Job manager: keeps the state of jobs in the catalogue; the engine only executes them."""

import asyncio
import logging
import uuid
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any, cast

from bench.catalogue import UNFINISHED_STATES, Catalogue, CatalogueUnavailableError, JobRow, RunRow
from bench.errors import LogError
from bench.jobs.engine import JobEngine
from bench.jobs.errors import JobError
from bench.jobs.job_spec import (
    FIT_FILE,
    TWIN_FILE,
    JobSpec,
    ResultSummary,
    compute_content_key,
    get_result_folder,
)
from bench.jobs.progress import JobProgress
from bench.jobs.scheduler import MAX_ATTEMPTS
from bench.jobs.settings import (
    DiagnoseSettings,
    IdentifySettings,
    JobKind,
    JobSettings,
    TrendSettings,
    get_kind,
    parse_settings,
)

ANALYSED_OUTCOMES = ("clean", "lossy")
"""Outcomes of a run after which its identification is followed by a diagnosis."""
_MODEL_FILES = {"identify": FIT_FILE, "diagnose": TWIN_FILE}
"""File that stands for a job as a model."""
_SUBMIT_PAUSE = 2.0
"""Time [s] before a job is submitted again, if the catalogue could not be read."""
_LOG = logging.getLogger(__name__)


class JobManager:
    """Creates jobs, submits them to the engine, and records their states.

    A job that was unfinished when the service ended is submitted again under its key.
    """

    def __init__(
        self,
        catalogue: Catalogue,
        engine: JobEngine,
        on_changed: Callable[[JobRow], None],
        locate_log: Callable[[RunRow], Path] | None = None,
    ) -> None:
        """Use a catalogue and an engine.

        Args:
            catalogue: catalogue of runs and jobs.
            engine: executes the jobs.
            on_changed: receives every changed job, in the event loop.
            locate_log: returns the path of a run's log and fetches it if it is not here; by default its path.
        """
        self._locate_log = locate_log or (lambda run: catalogue.resolve_path(run.log))
        self._catalogue, self._queue = catalogue, catalogue.job_queue
        self._engine = engine
        self._on_changed = on_changed
        # A job that is being cancelled must not be submitted at the same moment.
        self._submission_lock = asyncio.Lock()

    async def request(self, run: RunRow, settings: JobSettings) -> tuple[JobRow, bool]:
        """Queue a job on a run, unless an equal job is unfinished or done.

        An equal job that failed or was cancelled is queued again, and its attempts are counted on.

        Args:
            run: an ended run with a complete log.
            settings: of an identification or a diagnosis.

        Returns:
            The job, and whether it was queued now.

        Raises:
            JobError: the model of a job does not exist, or an equal job is still being stopped.
        """
        wanted = await asyncio.to_thread(self._make_job, run, settings)
        for job in await asyncio.to_thread(self._queue.find_repeatable, wanted.key):
            await self._engine.release(job.id)
        row, is_queued = await asyncio.to_thread(self._queue.request, wanted, self._has_files)
        if is_queued:
            await self._announce_queued(row)
        return row, is_queued

    async def identify(self, run: RunRow, settings: IdentifySettings) -> tuple[JobRow, bool]:
        """Queue the identification of a run, as `request` does."""
        return await self.request(run, settings)

    async def retry(self, job: JobRow, reason: str) -> JobRow | None:
        """Queue a failed or cancelled job again.

        Returns:
            The job, or None if it is in another state.

        Raises:
            JobError: it is still being stopped.
        """
        await self._engine.release(job.id)
        row = await asyncio.to_thread(self._queue.retry, job.id, reason)
        if row is not None:
            await self._announce_queued(row)
        return row

    async def on_connected(self) -> None:
        """Submit all unfinished jobs, in the order of the queue."""
        for job in await asyncio.to_thread(self._queue.list_unfinished):
            _LOG.info("job_submitted_again", extra={"job": job.id, "run": job.run_id, "attempts": job.attempts})
            await self._submit(job)

    async def cancel(self, job: JobRow) -> JobRow:
        """Cancel a job: a queued one at once, a running one as soon as its worker has stopped it."""
        async with self._submission_lock:
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
        if job.attempts - job.earlier_attempts >= MAX_ATTEMPTS:
            await self.on_failed(job_id, f"it was started {MAX_ATTEMPTS} times and never finished")
            await self._engine.cancel(job_id, started=True)
            return
        start = {"state": "running", "attempts": job.attempts + 1, "started": datetime.now(UTC)}
        await self._update_job(job_id, **start, stage="", fraction=0.0, activity="")

    async def on_progress(self, job_id: str, progress: JobProgress) -> None:
        """Record the progress of a job."""
        await self._update_job(job_id, **progress.to_document())

    async def on_done(self, job_id: str, summary: ResultSummary) -> None:
        """Record the result of a job; queue the diagnosis of a run that was identified for the first time."""
        job = await asyncio.to_thread(self._catalogue.get_job, job_id)
        run = await asyncio.to_thread(self._catalogue.get_run, job.run_id) if job else None
        if job is None or run is None:
            return
        folder = get_result_folder(self._catalogue.resolve_path(run.log), job.kind, job.key)
        result = self._catalogue.make_name(folder)
        is_followed = job.kind == "identify" and run.outcome in ANALYSED_OUTCOMES
        follow_up = self._make_row(run, DiagnoseSettings(), {"fit": job}) if is_followed else None
        await self._finish_job(
            job_id, follow_up, state="done", activity="", fraction=1.0, summary=summary, result=result
        )

    async def on_failed(self, job_id: str, reason: str) -> None:
        """Record the failure of a job."""
        await self._finish_job(job_id, state="failed", activity="", error=reason)

    async def on_cancelled(self, job_id: str) -> None:
        """Record that a job was cancelled."""
        await self._finish_job(job_id, state="cancelled", activity="")

    def _make_job(self, run: RunRow, settings: JobSettings) -> JobRow:
        """Return a new row for a job, which reads the newest fit of its run if it is a diagnosis."""
        if isinstance(settings, TrendSettings):
            return self._make_row(run, settings, {}, [one.log_sha256 or "" for one in self._get_runs(settings)])
        if isinstance(settings, IdentifySettings):
            return self._make_row(run, settings, {})
        inputs: dict[str, JobRow | None] = {}
        if isinstance(settings, DiagnoseSettings):
            inputs["fit"] = self._queue.find_newest_done(run.id, "identify")
        if settings.model is not None:
            inputs["model"] = self._get_model(settings.model)
        return self._make_row(run, settings, {name: job for name, job in inputs.items() if job is not None})

    def _get_model(self, job_id: str) -> JobRow:
        job = self._catalogue.get_job(job_id)
        if job is None or job.result is None or job.kind not in _MODEL_FILES:
            raise JobError(f"there is no fit or diagnosis {job_id}; give the id of a job that is done")
        return job

    def _get_runs(self, settings: TrendSettings) -> list[RunRow]:
        """Return the runs of a trend.

        Raises:
            JobError: a run is no longer in the catalogue.
        """
        rows = {run_id: self._catalogue.get_run(run_id) for run_id in settings.runs}
        missing = next((run_id for run_id, row in rows.items() if row is None), None)
        if missing is not None:
            raise JobError(f"run {missing} is no longer in the catalogue; request the trend again")
        return [row for row in rows.values() if row is not None]

    def _make_row(
        self, run: RunRow, settings: JobSettings, inputs: dict[str, JobRow], hashes: Sequence[str] = ()
    ) -> JobRow:
        keys = [*(f"{name}:{job.key}" for name, job in sorted(inputs.items())), *hashes]
        now = datetime.now(UTC)
        return JobRow(
            id=uuid.uuid4().hex,
            run_id=run.id,
            kind=get_kind(settings),
            key=compute_content_key(run.log_sha256 or "", settings, keys),
            settings=settings.model_dump(mode="json"),
            inputs={name: job.id for name, job in inputs.items()},
            version=version("mrbench"),
            state="queued",
            created=now,
            queued=now,
            attempts=0,
        )

    async def _announce_queued(self, row: JobRow) -> None:
        _LOG.info("job_queued", extra={"job": row.id, "run": row.run_id, "kind": row.kind})
        self._on_changed(row)
        await self._submit_at_last(row)

    async def _submit_at_last(self, job: JobRow) -> None:
        """Submit a queued job, again and again while the catalogue cannot be read: nobody else would submit it."""
        while True:
            try:
                return await self._submit(job)
            except CatalogueUnavailableError as error:
                _LOG.warning("job_not_submitted", extra={"job": job.id, "why": str(error)})
            await asyncio.sleep(_SUBMIT_PAUSE)

    async def _submit(self, job: JobRow) -> None:
        try:
            spec = await asyncio.to_thread(self._make_spec, job)
        except (JobError, LogError) as error:
            await self.on_failed(job.id, str(error))
            return
        async with self._submission_lock:
            present = await asyncio.to_thread(self._catalogue.get_job, job.id)
            if present is not None and present.state in UNFINISHED_STATES:
                await self._engine.submit(spec)

    def _make_spec(self, job: JobRow) -> JobSpec:
        """Return a job as it is sent to a worker.

        Raises:
            JobError: its run or its model no longer exists.
            LogError: a log is in a log store only, and cannot be fetched.
        """
        run = self._catalogue.get_run(job.run_id)
        if run is None:
            raise JobError(f"run {job.run_id} is no longer in the catalogue")
        log = self._locate_log(run)
        paths = {name: self._find_file(self._catalogue.get_job(source)) for name, source in job.inputs.items()}
        if paths.get("model") == "":
            raise JobError(f"the result of job {job.inputs['model']}, its model, was removed; give another model")
        settings = parse_settings(cast(JobKind, job.kind), job.settings)
        runs = self._get_runs(settings) if isinstance(settings, TrendSettings) else []
        return JobSpec(
            job_id=job.id,
            key=job.key,
            log=str(log),
            logs=tuple(str(self._locate_log(one)) for one in runs),
            result=str(get_result_folder(log, job.kind, job.key)),
            settings=settings,
            submission=job.submissions,
            fit=paths.get("fit", ""),
            model=paths.get("model", ""),
            log_sha256=run.log_sha256 or "",
        )

    def _has_files(self, job: JobRow) -> bool:
        return job.result is not None and self._catalogue.resolve_path(job.result).is_dir()

    def _find_file(self, source: JobRow | None) -> str:
        """Return the path of the fit or twin of a job; empty without a job or file."""
        if source is None or source.result is None:
            return ""
        path = self._catalogue.resolve_path(source.result) / _MODEL_FILES[source.kind]
        return str(path) if path.is_file() else ""

    async def _finish_job(self, job_id: str, follow_up: JobRow | None = None, **values: Any) -> None:
        values["finished"] = datetime.now(UTC)
        job, following = await asyncio.to_thread(lambda: self._queue.finish(job_id, follow_up, **values))
        if job is not None:
            self._announce_state(job)
        if following is not None:
            await self._announce_queued(following)

    async def _update_job(self, job_id: str, **values: Any) -> None:
        job = await asyncio.to_thread(lambda: self._catalogue.update_job(job_id, **values))
        if job is None:
            return
        if "state" in values:
            self._announce_state(job)
        else:
            self._on_changed(job)

    def _announce_state(self, job: JobRow) -> None:
        details = {"job": job.id, "run": job.run_id, "attempts": job.attempts, "error": job.error}
        _LOG.info(f"job_{job.state}", extra=details)
        self._on_changed(job)

"""Run registry: updates the catalogue from the agent and the data folder, and starts identifications."""

import asyncio
import logging
import time
from collections import defaultdict
from collections.abc import Awaitable, Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path

from bench.agent_protocol import AgentEvent, AgentStatus, RunStatus
from bench.campaigns import WARM_UP_METHOD
from bench.catalogue import (
    Catalogue,
    CatalogueUnavailableError,
    LogIntegrity,
    RunOutcome,
    RunRow,
    catalogue_log,
    is_complete,
    scan_logs,
)
from bench.checks import find_check_kind
from bench.jobs import IdentifySettings, JobManager
from bench.log_lines import RepeatedFailure
from bench.service.views import LiveEvent

SCAN_PERIOD = 5.0
"""Period of the scans of the data folder [s]."""
SETTLING_TIME = 10.0
"""Time without growth after which a log counts as no longer written, if the agent does not report it [s]."""
DAMAGED: tuple[LogIntegrity, ...] = ("changed", "missing")
"""Results of an integrity check after which a log is not identified."""
IDENTIFIED_OUTCOMES: tuple[RunOutcome, ...] = ("clean", "lossy")
"""Outcomes after which a run is identified automatically."""
_LOG = logging.getLogger(__name__)


class RunRegistry:
    """Record of the runs of all benches in the catalogue as they start and end."""

    def __init__(
        self,
        catalogue: Catalogue,
        job_manager: JobManager,
        statuses: Callable[[], Mapping[str, AgentStatus | None]],
        notify: Callable[[RunRow], Awaitable[None]],
    ) -> None:
        """Use a catalogue, a job manager and the agents of the benches.

        Args:
            catalogue: catalogue of the runs.
            job_manager: creates the identification jobs.
            statuses: returns by bench the current status of its agent, or None if it does not answer.
            notify: receives every changed run.
        """
        self._catalogue, self._job_manager = catalogue, job_manager
        self._get_statuses, self._on_changed = statuses, notify
        self._known_states: set[tuple[str, bool]] = set()
        self.lock = asyncio.Lock()
        """Held while logs are catalogued or moved."""
        self._failures = defaultdict[str, RepeatedFailure](
            lambda: RepeatedFailure(_LOG, "runs_not_recorded", "runs_recorded_again")
        )

    async def observe(self, status: AgentStatus, bench: str) -> None:
        """Record the runs in a status of a bench; runs without a change are skipped.

        A failure, such as a full disk, is logged when it begins and when it ends. The next status tries again.
        """
        try:
            await self._record_runs(status, bench)
        except Exception as error:  # the agent's runs go on, whatever prevents their record
            self._failures[bench].note(error)
        else:
            self._failures[bench].clear()

    async def _record_runs(self, status: AgentStatus, bench: str) -> None:
        runs = {run.id: run for run in (*status.finished, *([status.run] if status.run else []))}
        for run in runs.values():
            key = (run.id, run.outcome is not None)  # a run is recorded when it starts and when it ends
            if key not in self._known_states:
                async with self.lock:
                    await (self._finish_run(run, bench) if run.outcome else self._add_run(run, bench))
                # Added last, so that a failed update is tried again with the next status.
                self._known_states.add(key)

    def record_event(self, event: AgentEvent, bench: str) -> LiveEvent:
        """Store an event of a bench with its run in progress, and return it as listeners get it; from any thread.

        A failure, such as a full disk, is logged; the log of the run contains its events in any case.
        """
        status = self._get_statuses()[bench]
        run = status.run.id if status and status.run and status.run.outcome is None else None
        try:
            row = self._catalogue.event_journal.record(event.kind, event.text, run, bench)
        except CatalogueUnavailableError as error:
            self._failures[bench].note(error)
            return LiveEvent(**event.model_dump(), id=None, run=run, bench=bench, at=datetime.now(UTC))
        return LiveEvent(**event.model_dump(), id=row.id, run=row.run_id, bench=bench, at=row.at)

    async def scan(self) -> None:
        """Scan the data folder once; identify also what a kill has left without an identification."""
        async with self.lock:
            for row in await asyncio.to_thread(scan_logs, self._catalogue, self._is_being_written):
                await self._handle_change(row)
            for row in await asyncio.to_thread(self._catalogue.list_without_job, IDENTIFIED_OUTCOMES):
                await self._identify(row)

    async def scan_periodically(self) -> None:
        """Scan the data folder periodically."""
        failures = RepeatedFailure(_LOG, "scan_failed", "scan_succeeded_again")
        while True:
            try:
                await self.scan()
            except Exception as error:  # the task must not end, or later logs would not be found
                failures.note(error)
            else:
                failures.clear()
            await asyncio.sleep(SCAN_PERIOD)

    async def adopt(self, found: Path, log: Path) -> RunRow | None:
        """Move a log from elsewhere to its place in the data folder, and treat it as that of a recorded run.

        Args:
            found: complete file on the same disk.
            log: its place in the data folder, where no file exists.

        Returns:
            The new run; None if the catalogue has it already, and nothing was moved then.
        """
        async with self.lock:  # otherwise a scan could find the log between both steps
            row = await asyncio.to_thread(self._move, found, log)
            if row is not None:
                await self._handle_change(row, is_wanted=True)
        return row

    def _move(self, found: Path, log: Path) -> RunRow | None:
        found.rename(log)
        row = catalogue_log(self._catalogue, log)
        if row is None:
            log.rename(found)
        return row

    async def _add_run(self, run: RunStatus, bench: str) -> RunRow:
        row = await asyncio.to_thread(self._catalogue.get_run, run.id)
        if row is None:
            row = make_run_row(run, self._catalogue, bench)
            await asyncio.to_thread(self._catalogue.add, row)
            _LOG.info("run_began", extra={"run": row.id, "method": row.method, "specimen": row.specimen})
            await self._on_changed(row)
        return row

    async def _finish_run(self, run: RunStatus, bench: str) -> None:
        row = await self._add_run(run, bench)
        if row.bench is None:  # a scan has found the log before the agent has reported its run
            row = await asyncio.to_thread(self._catalogue.update_run, run.id, bench=bench)
        # A scan may have found the log first; if it has no end, only the agent knows how the run ended.
        if row.state == "running" or (row.ending is None and run.ending is not None):
            await self._handle_change(await asyncio.to_thread(self._record_end, run))

    def _record_end(self, run: RunStatus) -> RunRow:
        """Record the agent's report, and what the log contains beyond it."""
        # Before the log is read, because a log without end contains no reason and no ending.
        self._catalogue.update_run(run.id, ending=run.ending, reason=run.reason)
        path = Path(run.log)
        ended = catalogue_log(self._catalogue, path) if path.is_file() else None
        # Without a usable log, or with one on the agent's machine, the report is everything.
        return ended or self._catalogue.update_run(run.id, state="ended", outcome=run.outcome)

    async def _handle_change(self, row: RunRow, *, is_wanted: bool = False) -> None:
        """Publish a changed run and identify it if it is complete; an import only if a person has asked for it."""
        _LOG.info("run_" + row.state, extra={"run": row.id, "outcome": row.outcome, "reason": row.reason})
        await self._on_changed(row)
        await self._identify(row, is_wanted=is_wanted)

    async def _identify(self, row: RunRow, *, is_wanted: bool = False) -> None:
        """Queue the identification of a complete run without jobs."""
        is_complete_run = (
            (is_wanted or row.source == "run")
            and row.outcome in IDENTIFIED_OUTCOMES
            and row.log_sha256
            and row.method != WARM_UP_METHOD
            and find_check_kind(row.method) is None
        )
        if (
            is_complete_run
            and row.integrity not in DAMAGED
            and not await asyncio.to_thread(self._catalogue.list_jobs, 1, [row.id])
        ):
            await self._job_manager.identify(row, IdentifySettings())

    def _is_being_written(self, path: Path) -> bool:
        statuses = self._get_statuses()
        if any(_is_writing(status, path) for status in statuses.values()):
            return True
        # Its agent answers and does not write this known log.
        known = self._catalogue.find_run_by_log(path)
        if known is not None and _is_answering(statuses, known.bench):
            return False
        # Another program may record into the folder, or an agent that does not answer at present.
        return path.exists() and time.time() - path.stat().st_mtime < SETTLING_TIME and not is_complete(path)


def _is_writing(status: AgentStatus | None, path: Path) -> bool:
    run = status.run if status else None
    return run is not None and run.outcome is None and Path(run.log) == path


def _is_answering(statuses: Mapping[str, AgentStatus | None], bench: str | None) -> bool:
    """Return whether the agent of a bench answers; of an unknown bench, whether all agents do."""
    if bench is not None and bench in statuses:
        return statuses[bench] is not None
    return all(status is not None for status in statuses.values())


def make_run_row(run: RunStatus, catalogue: Catalogue, bench: str) -> RunRow:
    """Return the row of a run that has begun on a bench, as its agent describes it; it is not added."""
    return RunRow(
        id=run.id,
        method=run.method,
        method_version=catalogue.find_method_version(run.method, run.method_sha256),
        method_sha256=run.method_sha256 or None,
        specimen=run.specimen,
        operator=run.operator,
        bench=bench,
        source="run",
        continues=run.continues or None,
        calibration_overdue=list(run.calibration_overdue),
        failed_checks=list(run.failed_checks),
        started=_parse_utc(run.started),
        duration_s=run.duration_s,
        state="running",
        reason="",  # the column's default applies only when the row is added
        log=catalogue.make_name(Path(run.log)),
    )


def _parse_utc(text: str) -> datetime:
    """Parse a time of the agent; return the current time if it is invalid."""
    try:
        time_utc = datetime.fromisoformat(text)
    except ValueError:
        return datetime.now(UTC)
    return time_utc if time_utc.tzinfo else time_utc.replace(tzinfo=UTC)

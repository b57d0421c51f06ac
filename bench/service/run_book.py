"""Keeps the catalogue's runs in step with the agent and the data folder, and has what has ended identified."""

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable
from datetime import UTC, datetime
from pathlib import Path

from bench.agent.messages import AgentStatus, RunStatus
from bench.catalogue.catalogue import Catalogue
from bench.catalogue.log_facts import has_end
from bench.catalogue.models import RunRow
from bench.catalogue.scan import catalogue_log, scan
from bench.jobs.keeper import JobKeeper
from bench.jobs.order import IdentifySettings

SCAN_EVERY = 5.0
"""[s] between two looks into the data folder."""
SETTLED = 10.0
"""[s] after which a log that has not grown is written by nobody, where no agent can say so."""
WORTH_A_FIT = ("clean", "lossy")
_LOG = logging.getLogger(__name__)


class RunBook:
    """Writes down runs as they begin and end."""

    def __init__(
        self,
        catalogue: Catalogue,
        keeper: JobKeeper,
        status: Callable[[], AgentStatus | None],
        notify: Callable[[RunRow], Awaitable[None]],
    ) -> None:
        """Take its surroundings.

        Args:
            catalogue: where runs are written down.
            keeper: has runs identified.
            status: the agent's present status, none where it does not answer.
            notify: told of runs that have changed.
        """
        self._catalogue, self._keeper = catalogue, keeper
        self._status, self._notify = status, notify
        self._seen: set[tuple[str, bool]] = set()
        self._one_at_a_time = asyncio.Lock()

    async def observe(self, status: AgentStatus) -> None:
        """Write down what a status says of runs; what is known already costs nothing."""
        told = {run.id: run for run in (*status.finished, *([status.run] if status.run else []))}
        for run in told.values():
            mark = (run.id, run.outcome is not None)  # a run is news twice: when it begins and when it ends
            if mark not in self._seen:
                async with self._one_at_a_time:
                    await (self._end(run) if run.outcome else self._begin(run))
                # Only now: what could not be written down is tried again with the next status.
                self._seen.add(mark)

    async def scan(self) -> None:
        """Look into the data folder once."""
        async with self._one_at_a_time:
            for row in await asyncio.to_thread(scan, self._catalogue, self._still_written):
                await self._changed(row)

    async def scan_on(self) -> None:
        """Look into the data folder again and again."""
        while True:
            try:
                await self.scan()
            except Exception as error:  # a task that ends in silence would leave all later logs unseen
                _LOG.warning("scan_failed", extra={"why": repr(error)})
            await asyncio.sleep(SCAN_EVERY)

    async def _begin(self, run: RunStatus) -> RunRow:
        row = await asyncio.to_thread(self._catalogue.run, run.id)
        if row is None:
            row = _row(run, self._catalogue)
            await asyncio.to_thread(self._catalogue.add, row)
            _LOG.info("run_began", extra={"run": row.id, "method": row.method, "specimen": row.specimen})
            await self._notify(row)
        return row

    async def _end(self, run: RunStatus) -> None:
        row = await self._begin(run)
        if row.state != "running":
            return
        ended = await asyncio.to_thread(self._from_log, Path(run.log))
        if ended is None:
            # The log is on the agent's machine, or was never begun: its own word has to do.
            values = {"state": "ended", "outcome": run.outcome, "reason": run.reason}
            ended = await asyncio.to_thread(lambda: self._catalogue.change_run(row.id, **values))
        await self._changed(ended)

    def _from_log(self, path: Path) -> RunRow | None:
        return catalogue_log(self._catalogue, path) if path.is_file() else None

    async def _changed(self, row: RunRow) -> None:
        _LOG.info("run_" + row.state, extra={"run": row.id, "outcome": row.outcome, "reason": row.reason})
        await self._notify(row)
        worth_a_fit = row.source == "run" and row.outcome in WORTH_A_FIT and row.log_sha256
        if worth_a_fit and not await asyncio.to_thread(self._catalogue.jobs, 1, [row.id]):
            await self._keeper.identify(row, IdentifySettings())

    def _still_written(self, path: Path) -> bool:
        status = self._status()
        run = status.run if status else None
        if run is not None and run.outcome is None and Path(run.log) == path:
            return True
        # The agent is there, and this known log is none that it says it writes.
        if status is not None and self._catalogue.run_of_log(path) is not None:
            return False
        # Another program may record into the folder, or an agent that cannot be asked just now.
        return path.exists() and time.time() - path.stat().st_mtime < SETTLED and not has_end(path)


def _row(run: RunStatus, catalogue: Catalogue) -> RunRow:
    return RunRow(
        id=run.id,
        method=run.method,
        specimen=run.specimen,
        operator=run.operator,
        source="run",
        started=_utc(run.started),
        duration_s=run.duration_s,
        state="running",
        log=catalogue.name_of(Path(run.log)),
    )


def _utc(text: str) -> datetime:
    """A time as the agent says it; now, where it is none."""
    try:
        found = datetime.fromisoformat(text)
    except ValueError:
        return datetime.now(UTC)
    return found if found.tzinfo else found.replace(tzinfo=UTC)

"""Execution of one campaign: stores each transition before it acts, so that it may be killed at any moment."""

import fcntl
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from bench.campaigns.benches import CampaignBench
from bench.campaigns.document import CampaignError
from bench.campaigns.engine import CampaignState, ExecutionReport, Message, Observation, advance, recover
from bench.campaigns.store import CampaignStore, StoredCampaign
from bench.errors import BenchError


class CampaignRunner:
    """Executor of one campaign on one bench."""

    def __init__(
        self,
        store: CampaignStore,
        campaign_id: str,
        bench: CampaignBench,
        on_message: Callable[[Message], None] | None = None,
    ) -> None:
        """Use a campaign in the catalogue and a bench; ``on_message`` receives its messages."""
        self._store, self._id, self._bench = store, campaign_id, bench
        self._on_message = on_message or (lambda message: None)
        self._paused_log = ""

    def run(self, is_stopping: Callable[[], bool] = lambda: False) -> StoredCampaign:
        """Execute the campaign until it ends or this process is to end, and return it.

        Args:
            is_stopping: returns whether this process is to end; a run in progress is not stopped.
        """
        campaign = self.take_over()
        while not campaign.state.has_ended and not is_stopping():
            campaign = self.step(campaign)
        return campaign

    def take_over(self) -> StoredCampaign:
        """Continue the campaign of a process that has ended."""
        campaign = self._store.get(self._id)
        report = self._bench.recover(campaign)
        return self._advance(lambda state, now: recover(state, Observation(report=report), now, self._id))

    def step(self, campaign: StoredCampaign) -> StoredCampaign:
        """Observe, make one transition, act on it, and let time pass."""
        seen = self._bench.observe(campaign)
        campaign = self._advance(lambda state, now: advance(state, seen, now, self._id))
        self._bench.keep_lease(campaign)
        active = campaign.state.active
        if active is not None and active.phase == "starting":
            campaign = self._start(campaign)
        elif active is not None and active.phase == "stroking" and campaign.state.status == "pausing":
            self._request_pause(campaign)
        self._bench.wait(campaign)
        return self._store.get(self._id)

    def _start(self, campaign: StoredCampaign) -> StoredCampaign:
        try:
            self._bench.start(campaign)
        except BenchError as error:
            refused = Observation(report=ExecutionReport(kind="refused", reason=str(error)))
            return self._advance(lambda state, now: advance(state, refused, now, self._id))
        return campaign

    def _request_pause(self, campaign: StoredCampaign) -> None:
        """Ask once for each run; the bench then ends it at its next checkpoint."""
        active = campaign.state.active
        log = active.execution.log if active is not None and active.execution is not None else ""
        if log != self._paused_log:
            self._bench.request_pause(campaign)
            self._paused_log = log

    def _advance(self, transition: Callable[[CampaignState, float], CampaignState]) -> StoredCampaign:
        """Store the state after a transition, and report its messages."""
        now = self._bench.now()
        messages: tuple[Message, ...] = ()

        def apply(state: CampaignState) -> CampaignState:
            nonlocal messages
            after = transition(state, now)
            messages = after.outbox
            return after

        campaign = self._store.update(self._id, apply)
        for message in messages:
            self._on_message(message)
        return campaign


@contextmanager
def lock_campaign(folder: Path, campaign_id: str) -> Iterator[None]:
    """Lock a campaign for one executor at a time; the system releases the lock when a process is killed.

    Raises:
        CampaignError: another process executes it.
    """
    path = folder / f"{campaign_id}.lock"
    with path.open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise CampaignError(f"campaign {campaign_id} is executed by another process") from None
        file.write(str(os.getpid()))
        file.flush()
        yield
    path.unlink(missing_ok=True)

"""Executor of campaigns on the rig agent: a thread of the service that continues what is in progress."""

import logging
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Self

from bench.agent_protocol import BenchDescription, Sender, send_as
from bench.campaigns import (
    AgentBench,
    AgentConnection,
    AnyStep,
    Campaign,
    CampaignError,
    CampaignRunner,
    CampaignStore,
    Methods,
    NoWorkerError,
    StoredCampaign,
    Thermometer,
    find_problems,
    stop,
)
from bench.catalogue import Catalogue
from bench.config import get_executor
from bench.disk import find_usable_space
from bench.errors import AgentUnreachableError, MethodError
from bench.log_lines import RepeatedFailure
from bench.service.bench_check import compare_with_bench
from bench.threads import BackgroundThread

PERIOD = 0.5
"""[s] Time between two observations of a campaign, and between two looks for a new one."""
WORKER_TIME = 60.0
"""[s] Time after the start of the service in which a worker may still connect."""
_LOG = logging.getLogger(__name__)


class CampaignExecutor(BackgroundThread):
    """Thread that executes the campaigns of one bench, one after the other, oldest first.

    At its end, a run in progress goes on in the agent, and the next service continues the campaign.
    """

    def __init__(
        self,
        catalogue: Catalogue,
        agent: AgentConnection,
        bench: str,
        describe_worker: Callable[[], str],
        describe_bench: Callable[[], BenchDescription],
        *,
        is_local: bool,
    ) -> None:
        """Use a catalogue and an agent.

        Args:
            catalogue: catalogue of the data folder.
            agent: connection to the agent.
            bench: name of the bench in the service.
            describe_worker: returns `ok`, or the reason why there is no worker; called outside the event loop.
            describe_bench: returns drive and limits of the bench.
            is_local: whether the agent writes into the data folder; else nothing is executed.
        """
        super().__init__(f"campaigns-{bench}")
        self.executor = get_executor(bench)
        """Name that the catalogue gives to this executor."""
        self.store = CampaignStore(catalogue, describe_worker)
        self.thermometer = Thermometer()
        self.is_local = is_local
        self._describe_bench, self._started = describe_bench, time.monotonic()
        self._failures = RepeatedFailure(_LOG, "campaign_failed", "campaign_continues")
        self.bench = AgentBench(
            catalogue, agent, self.thermometer, lambda: self._stopping.wait(PERIOD), name=bench
        )

    def __enter__(self) -> Self:
        """Start the thread if the agent writes into the data folder."""
        return super().__enter__() if self.is_local else self

    def check_start(self, campaign: Campaign, steps: Sequence[AnyStep], methods: Methods) -> None:
        """Check that a campaign can be executed to its end; every way to start one passes this check.

        Args:
            campaign: document of the campaign.
            steps: its steps.
            methods: its methods by name.

        Raises:
            CampaignError: a condition can never be met, a method may not be run or exceeds the bench, the logs do
                not fit on the disk, or the agent does not answer.
            MethodError: a method cannot be compiled within its limits.
            RunError: the state of the workers is not known.
        """
        self.store.check_needs(campaign, steps, methods)
        self.bench.check_needs(campaign, steps)
        try:
            compare = partial(compare_with_bench, self._describe_bench())
        except AgentUnreachableError as error:
            raise CampaignError(f"the limits of the bench are not known: {error}") from None
        free = find_usable_space(self.store.catalogue.folder)
        if problems := find_problems(tuple(steps), methods, free, compare):
            raise CampaignError(f"the campaign cannot be run: {problems[0]}")

    def _run(self) -> None:
        while not self._stopping.is_set():
            try:
                self._execute_oldest()
            except Exception as error:  # the thread must not end, or the campaign would stand still without a word
                self._failures.note(error)
            else:
                self._failures.clear()
            self._stopping.wait(PERIOD)

    def _execute_oldest(self) -> None:
        in_progress = self.store.list_in_progress(self.executor)
        if not in_progress or not self._may_begin(in_progress[0]):
            return
        sender = Sender(actor=f"campaign:{in_progress[0].id}")
        with send_as(lambda: sender):
            ended = CampaignRunner(self.store, in_progress[0].id, self.bench).run(self._stopping.is_set)
        _LOG.info("campaign_left", extra={"campaign": ended.id, "status": ended.state.status})

    def _may_begin(self, campaign: StoredCampaign) -> bool:
        """Stop a campaign that has not begun and can never be executed; return False if that is not known yet."""
        state = campaign.state
        if state.active is not None or any(item.state != "pending" for item in state.items):
            return True
        try:
            self.check_start(state.campaign, [item.step for item in state.items], campaign.methods)
        except (CampaignError, MethodError) as error:
            # After a restart of the service, its worker connects some seconds later.
            if isinstance(error, NoWorkerError) and time.monotonic() - self._started < WORKER_TIME:
                return False
            reason, now = str(error), campaign.read_time()
            self.store.update(campaign.id, lambda present: stop(present, now, reason=reason))
        return True

"""Rig agent as the bench of a campaign; the agent executes the runs, also while the service is down."""

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from bench.agent_protocol import (
    AgentStatus,
    LeaseCommand,
    PauseCommand,
    RunCommand,
    RunStatus,
    StatusCommand,
    get_sender,
)
from bench.campaigns.benches.agent_setup import AgentSetup, find_setup
from bench.campaigns.benches.protocol import AgentConnection
from bench.campaigns.benches.recovery import make_end_report, recover_execution
from bench.campaigns.benches.results import read_result
from bench.campaigns.document import Campaign, CampaignError, Step
from bench.campaigns.engine import (
    ExecutionReport,
    Observation,
    RunResult,
    find_spec,
    make_method,
    needs_thermometer,
)
from bench.campaigns.store import StoredCampaign
from bench.catalogue import Catalogue
from bench.config import DEFAULT_BENCH
from bench.errors import BenchError, RunError
from bench.live import LiveBatch

START_TIMEOUT = 10.0
"""[s] Time limit from an accepted command to the run in the agent's status."""
READING_LIFETIME = 30.0
"""[s] Age up to which a reading of the thermometer counts."""
LEASE_TIME = 15.0
"""[s] Time for which the bench stays with a campaign whose executor was killed."""
_LEASE_PERIOD = 5.0
"""[s] Time between two renewals of the lease."""
_START_PERIOD = 0.1
"""[s] Time between two requests of the status after a start."""


class Thermometer:
    """Latest temperature of the specimen in the samples of the agent."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Read the age of readings from a clock [s]."""
        self._clock = clock
        self._value: float | None = None
        self._read_at = float("-inf")

    def take(self, batch: LiveBatch) -> None:
        """Take the newest temperature of a batch, if it has one."""
        for channel, values in zip(batch.channels, batch.values, strict=True):
            shown = values[np.isfinite(values)] if channel.name == "temperature" else values[:0]
            if shown.size:
                self._value, self._read_at = float(shown[-1]), self._clock()

    def read(self) -> float | None:
        """Return the temperature [°C]; None without a reading within `READING_LIFETIME`."""
        return self._value if self._clock() - self._read_at <= READING_LIFETIME else None


class AgentBench:
    """Bench of one rig agent, whose logs are in the data folder."""

    def __init__(
        self,
        catalogue: Catalogue,
        agent: AgentConnection,
        thermometer: Thermometer,
        wait: Callable[[], object],
        sleep: Callable[[float], None] = time.sleep,
        name: str = DEFAULT_BENCH,
    ) -> None:
        """Use an agent.

        Args:
            catalogue: catalogue of the data folder, which the service keeps up to date.
            agent: connection to the agent.
            thermometer: latest temperature.
            wait: lets time pass until the next observation.
            sleep: waits for a time [s] while a run starts.
            name: name of the bench in the service.
        """
        self._name = name
        self._catalogue, self._agent, self._thermometer = catalogue, agent, thermometer
        self._wait, self._sleep = wait, sleep
        self._has_lease, self._renewal = False, float("-inf")
        self._setup = AgentSetup(agent)

    def check_needs(self, campaign: Campaign, steps: Sequence[Step]) -> None:
        """Check that there is a thermometer if a condition needs one.

        Raises:
            CampaignError: the agent does not answer, or has no thermometer that works.
        """
        status = self._get_status()
        if status is None:
            raise CampaignError("the rig agent does not answer; start it, then the campaign")
        has_one = any(one.driver == "thermometer" and one.connected for one in status.instruments)
        if needs_thermometer(steps) and not has_one:
            raise CampaignError(
                "the campaign has a condition on the temperature, but the bench has no thermometer that answers; "
                "connect one, or use rests of a fixed time"
            )

    def now(self) -> float:
        """Return the UTC [s]."""
        return time.time()

    def recover(self, campaign: StoredCampaign) -> ExecutionReport | None:
        """Return the state of the active run, from the agent or from its log, or that of a setup step."""
        return self._setup.take_over(campaign) if find_setup(campaign) else self._report(campaign)

    def observe(self, campaign: StoredCampaign) -> Observation:
        """Return the state of run or setup step, the temperature, new results, and the readiness of the agent."""
        return Observation(
            report=self._report(campaign) if campaign.state.is_executing else None,
            temperature_c=self._thermometer.read(),
            results=self._read_results(campaign),
            obstacle=_find_obstacle(self._get_status()),
        )

    def start(self, campaign: StoredCampaign) -> None:
        """Send the active setup step to the agent, or the active run and wait until its status has it.

        Raises:
            BenchError: the agent refuses it or does not answer.
        """
        state = campaign.state
        if find_setup(campaign) is not None:
            self._setup.start(campaign)
        if state.active is None or state.active.execution is None:
            return
        item, execution = state.get_item(state.active.item), state.active.execution
        method = make_method(state, item, campaign.methods)
        path = self._catalogue.folder / execution.log
        certificates = self._catalogue.certificates.list_current(datetime.now(UTC).date(), self._name)
        command = RunCommand(
            method=method.model_dump(mode="json", by_alias=True, exclude_defaults=True),
            specimen=find_spec(state, item).specimen,
            operator=state.operator,
            resume_after=execution.resume_after,
            continues=execution.continues,
            certificates=tuple(certificates.values()),
            checks=self._catalogue.checks.list_latest(self._name),
            log=str(path),
        )
        status = self._agent.send_command(command)
        deadline = time.monotonic() + START_TIMEOUT
        while _find_run(status, path) is None:
            if time.monotonic() > deadline:
                raise RunError(f"the rig agent accepted the run but did not start it within {START_TIMEOUT:g} s")
            self._sleep(_START_PERIOD)
            status = self._agent.send_command(StatusCommand())

    def request_pause(self, campaign: StoredCampaign) -> None:
        """Ask the agent to end the run at its next checkpoint."""
        self._agent.send_command(PauseCommand())

    def keep_lease(self, campaign: StoredCampaign) -> None:
        """Keep the lease while the campaign may start something, and end it when it may not."""
        needs_lease, now = campaign.state.needs_lease, time.monotonic()
        is_due = needs_lease and now >= self._renewal
        if not is_due and needs_lease == self._has_lease:
            return
        operator = f" of {campaign.state.operator}" if campaign.state.operator else ""
        command = LeaseCommand(
            description=f"campaign {campaign.id}{operator}"[:300], duration_s=LEASE_TIME if needs_lease else 0.0
        )
        with suppress(BenchError):  # the next observation tells why the bench cannot be used
            self._agent.send_command(command)
            self._has_lease, self._renewal = needs_lease, now + _LEASE_PERIOD

    def wait(self, campaign: StoredCampaign) -> None:
        """Let time pass until the next observation."""
        self._wait()

    def _get_status(self) -> AgentStatus | None:
        """Return the status of the agent, requested if the latest is old; None if it does not answer."""
        try:
            return self._agent.get_status()
        except BenchError:
            return None

    def _report(self, campaign: StoredCampaign) -> ExecutionReport | None:
        """Return the state of the active run or setup step; None while it is not known."""
        if find_setup(campaign) is not None:
            return self._setup.report(campaign)
        active = campaign.state.active
        if active is None or active.execution is None:
            return None
        status = self._get_status()
        if status is None:  # it may record meanwhile
            return None
        path = self._catalogue.folder / active.execution.log
        run = _find_run(status, path)
        if run is None:
            return self._report_without_agent(path, has_begun=active.phase == "stroking")
        if run.outcome is None:
            return ExecutionReport(kind="running", run=run.id)
        return self._report_end(run, path)

    def _report_end(self, run: RunStatus, path: Path) -> ExecutionReport:
        """Return the end of a run as soon as the service has recorded it."""
        row = self._catalogue.get_run(run.id)
        if row is None or row.state == "running":
            return ExecutionReport(kind="running", run=run.id)
        if row.state == "truncated":
            return recover_execution(self._catalogue, path.name)
        return make_end_report(self._catalogue, row, path)

    def _report_without_agent(self, path: Path, *, has_begun: bool) -> ExecutionReport:
        """Return the state of a run that the agent does not know: it was restarted, or never got the command."""
        if path.is_file() or has_begun:
            return recover_execution(self._catalogue, path.name)
        return ExecutionReport(kind="absent")

    def _read_results(self, campaign: StoredCampaign) -> dict[str, RunResult]:
        results = {}
        for fact in campaign.state.facts:
            known = campaign.state.results.get(fact.run)
            if known is None or not (known.is_diagnosed or known.failure):
                found = read_result(self._catalogue, fact.run)
                if found is not None and found != known:
                    results[fact.run] = found
        return results


def _find_run(status: AgentStatus, path: Path) -> RunStatus | None:
    runs = [*status.finished, *([status.run] if status.run else [])]
    return next((run for run in reversed(runs) if Path(run.log) == path), None)


def _find_obstacle(status: AgentStatus | None) -> str:
    if status is None:
        return "the rig agent does not answer"
    if status.lease is not None and status.lease.holder != get_sender().actor:
        return f"{status.lease.description} holds the bench"
    if status.state == "tripped":
        return f"the rig agent has tripped: {status.trip}; reset it after the cause is removed"
    return "" if status.state == "idle" else f"the rig agent is {status.state}"

"""Setup steps of campaigns on the rig agent, of which each is sent once.

The status of the agent has the latest setup step only, without an id. A process that takes over a campaign
therefore accepts a result only if the step had been seen in progress. Else the step counts as interrupted.
"""

from bench.agent_protocol import AgentStatus, PrepareCommand, SetupStatus, StatusCommand
from bench.campaigns.benches.protocol import AgentConnection
from bench.campaigns.document import BenchSetupStep, SetupSpec
from bench.campaigns.engine import Active, ExecutionReport
from bench.campaigns.store import StoredCampaign
from bench.endings import ABORT_REASON, SHUT_DOWN_REASON, STOP_REASON
from bench.errors import BenchError, RunError

_UNKNOWN = "the process that requested it ended, and whether it was done is not known"
_RESTARTED = "the rig agent was restarted before the step had ended"
_FOLLOWED = "another setup step followed before its result was read"


class AgentSetup:
    """Executor of the setup steps of campaigns on one agent."""

    def __init__(self, agent: AgentConnection) -> None:
        self._agent = agent
        self._sent = ""
        self._is_taken_over = False

    def take_over(self, campaign: StoredCampaign) -> ExecutionReport | None:
        """Return what became of the setup step of a process that has ended; it is not sent again."""
        active = campaign.state.active
        if active is None:
            return None
        self._sent, self._is_taken_over = _identify(campaign, active), True
        return self.report(campaign)

    def start(self, campaign: StoredCampaign) -> None:
        """Send the active setup step, once.

        Raises:
            BenchError: the agent refuses it or does not answer.
        """
        active, spec = campaign.state.active, find_setup(campaign)
        if active is None or spec is None or self._sent == _identify(campaign, active):
            return
        self._sent, self._is_taken_over = _identify(campaign, active), False
        try:
            self._agent.send_command(PrepareCommand(step=spec.step, position_m=spec.position_m))
        except RunError as error:
            # The status tells a failure of the step from a refusal, and whether a person has ended it.
            step = self._agent.send_command(StatusCommand()).step
            if step is None or (step.step, step.outcome, step.message) != (spec.step, "failed", str(error)):
                raise

    def report(self, campaign: StoredCampaign) -> ExecutionReport | None:
        """Return the state of the active setup step; None while it is not known."""
        active, spec = campaign.state.active, find_setup(campaign)
        if active is None or spec is None:
            return None
        try:
            # The latest published status may be older than the step.
            status = self._agent.send_command(StatusCommand())
        except BenchError:
            return None
        step = status.step
        if step is None:
            return ExecutionReport(kind="crashed", reason=_RESTARTED)
        if step.step != spec.step:
            return ExecutionReport(kind="crashed", reason=_FOLLOWED)
        if step.outcome == "running" or status.state == "preparing":
            return ExecutionReport(kind="running")
        if self._is_taken_over and active.phase == "starting":
            return ExecutionReport(kind="crashed", reason=_UNKNOWN)
        return _report_end(status, step)


def find_setup(campaign: StoredCampaign) -> SetupSpec | None:
    """Return the setup step in progress, or None."""
    active = campaign.state.active
    step = None if active is None else campaign.state.get_item(active.item).step
    return step.setup if isinstance(step, BenchSetupStep) else None


def _identify(campaign: StoredCampaign, active: Active) -> str:
    """Return what tells one request of a setup step from every other one."""
    return f"{campaign.id} {active.item} {active.since}"


def _report_end(status: AgentStatus, step: SetupStatus) -> ExecutionReport:
    if step.outcome == "done":
        return ExecutionReport(kind="ended", reason=step.message)
    return ExecutionReport(kind="refused", reason=status.trip or step.message, ending=_find_ending(status, step))


def _find_ending(status: AgentStatus, step: SetupStatus) -> str:
    """Return what has ended a step that failed: stopped or aborted by a person, tripped; else empty."""
    if status.trip:
        return "aborted" if ABORT_REASON in status.trip else "tripped"
    return "stopped" if step.message.startswith((STOP_REASON, SHUT_DOWN_REASON)) else ""

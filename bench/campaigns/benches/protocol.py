"""Benches that execute campaigns, the rig agent or the simulated plant, and the connection to an agent."""

from collections.abc import Sequence
from typing import Protocol

from bench.agent_protocol import AgentStatus, Message
from bench.campaigns.document import Campaign, Step
from bench.campaigns.engine import ExecutionReport, Observation
from bench.campaigns.store import StoredCampaign


class AgentConnection(Protocol):
    """Connection to the agent, such as the monitor of the service."""

    def get_status(self) -> AgentStatus:
        """Return the current status.

        Raises:
            BenchError: the agent does not answer.
        """

    def send_command(self, command: Message, timeout: float = 5.0) -> AgentStatus:
        """Send a command and return the status after it.

        Raises:
            BenchError: the agent refuses it or does not answer.
        """


class CampaignBench(Protocol):
    """Executor of a campaign's runs, with its own clock."""

    def check_needs(self, campaign: Campaign, steps: Sequence[Step]) -> None:
        """Check that every condition can be met.

        Raises:
            CampaignError: one never can, such as a temperature without a thermometer.
        """

    def now(self) -> float:
        """Return the present UTC [s]; that of the simulated clock on the simulated plant."""

    def recover(self, campaign: StoredCampaign) -> ExecutionReport | None:
        """Return what became of the active execution of a process that has ended."""

    def observe(self, campaign: StoredCampaign) -> Observation:
        """Return an observation for the next transition."""

    def start(self, campaign: StoredCampaign) -> None:
        """Start the active execution.

        Raises:
            BenchError: the bench refuses it.
        """

    def request_pause(self, campaign: StoredCampaign) -> None:
        """Ask the run in progress to end at its next checkpoint."""

    def keep_lease(self, campaign: StoredCampaign) -> None:
        """Keep the lease of the bench, or end it while the campaign waits for a person."""

    def wait(self, campaign: StoredCampaign) -> None:
        """Let time pass until the next observation."""

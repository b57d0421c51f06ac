"""One bench of a service, with everything that belongs to it alone."""

from dataclasses import dataclass

from bench.config import DEFAULT_BENCH
from bench.live import LiveBroadcaster
from bench.service.agent_monitor import AgentLink, AgentMonitor
from bench.service.campaigns import CampaignExecutor


@dataclass(frozen=True)
class BenchSettings:
    """Name and rig agent of a bench."""

    link: AgentLink
    has_local_logs: bool = True
    """True if the agent writes into the service's data folder."""
    name: str = DEFAULT_BENCH


@dataclass(frozen=True)
class ServedBench:
    """One bench: its rig agent, its live messages, and its campaigns.

    Each bench has threads and sockets of its own, so that an agent that is silent holds up no other bench.
    """

    name: str
    monitor: AgentMonitor
    live: LiveBroadcaster
    campaigns: CampaignExecutor
    has_local_logs: bool
    """True if the agent writes into the service's data folder."""

    @property
    def executor(self) -> str:
        """Executor of its campaigns, as the catalogue calls it."""
        return self.campaigns.executor

    def request_end(self) -> None:
        """Let its threads end, without waiting for them."""
        self.monitor.request_end()
        self.campaigns.request_end()

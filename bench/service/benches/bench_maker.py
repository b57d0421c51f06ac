"""Creation of a bench: its objects, connected with those that all benches share."""

import asyncio
from collections.abc import Callable

from pydantic import BaseModel

from bench.agent_protocol import AgentEvent, AgentStatus
from bench.catalogue import Catalogue
from bench.live import LiveBatch, LiveBroadcaster
from bench.service.agent_monitor import AgentMonitor
from bench.service.audit import AuditTrail, RecordedConnection
from bench.service.benches.served_bench import BenchSettings, ServedBench
from bench.service.campaigns import CampaignExecutor
from bench.service.run_registry import RunRegistry


class BenchMaker:
    """Maker of the benches of one service."""

    def __init__(
        self,
        catalogue: Catalogue,
        registry: RunRegistry,
        audit: AuditTrail,
        describe_worker: Callable[[], str],
        loop: asyncio.AbstractEventLoop,
    ) -> None:
        """Use what all benches share.

        Args:
            catalogue: catalogue of the data folder.
            registry: records the runs of all benches.
            audit: audit trail of the service.
            describe_worker: returns `ok`, or the reason why there is no worker; called outside the loop.
            loop: event loop of the service.
        """
        self._catalogue, self._registry, self._audit, self._loop = catalogue, registry, audit, loop
        self._describe_worker = describe_worker

    def make(self, settings: BenchSettings) -> ServedBench:
        """Return a bench; its threads are not started."""
        name, live = settings.name, LiveBroadcaster()
        publish = live.make_publisher(self._loop)

        def on_status(status: AgentStatus) -> None:
            if not self._loop.is_closed():
                asyncio.run_coroutine_threadsafe(self._registry.observe(status, name), self._loop)

        def on_message(topic: str, message: BaseModel | LiveBatch) -> None:
            if isinstance(message, AgentEvent):
                message = self._registry.record_event(message, name)
            publish(topic, message)
            if isinstance(message, LiveBatch):
                campaigns.thermometer.take(message)

        monitor = AgentMonitor(settings.link, on_message, on_status)
        recorded = RecordedConnection(monitor, self._audit.record, name)
        campaigns = CampaignExecutor(
            self._catalogue,
            recorded,
            name,
            self._describe_worker,
            monitor.describe_bench,
            is_local=settings.has_local_logs,
        )
        return ServedBench(name, monitor, live, campaigns, settings.has_local_logs)

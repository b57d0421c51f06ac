"""Connection of the service to the rig agent: keeps its latest status and forwards its messages."""

import logging
import threading
import time
from collections.abc import Callable, Iterator
from typing import Protocol

from pydantic import BaseModel

from bench.agent_protocol import (
    AgentEvent,
    AgentStatus,
    BenchDescription,
    DescribeCommand,
    Message,
    Reply,
    ResetCommand,
    StatusCommand,
)
from bench.errors import AgentUnreachableError, NoRigError, RunError
from bench.live import LiveBatch

STATUS_LIFETIME = 2.0
"""Age up to which a status counts as current [s]; the agent publishes four per second."""
_RETRY_TIME = 0.5
"""Pause before a new subscription after a message that cannot be used [s]."""
_LOG = logging.getLogger(__name__)

PublishedMessage = AgentStatus | LiveBatch | AgentEvent | None


class AgentLink(Protocol):
    """Connection to the agent, such as `bench.agent_protocol.AgentClient`."""

    def send(self, command: Message, timeout: float = 5.0) -> Reply:
        """Send one command and wait for its reply.

        Raises:
            AgentUnreachableError: no reply arrived within the timeout [s].
        """

    def subscribe(self, stopping: threading.Event) -> Iterator[PublishedMessage]:
        """Yield the messages that the agent publishes, and None at intervals while it is silent."""


class NoAgent:
    """Replacement for an agent that is not configured; recordings are still catalogued, identified and shown."""

    _MESSAGE = "no rig agent is configured; start the service with --config bench.toml or --agent ADDRESS"

    def send(self, command: Message, timeout: float = 5.0) -> Reply:
        """Refuse the command.

        Raises:
            NoRigError: always.
        """
        raise NoRigError(self._MESSAGE)

    def subscribe(self, stopping: threading.Event) -> Iterator[PublishedMessage]:
        """Yield only None, until the service stops."""
        while not stopping.wait(0.5):
            yield None


class AgentMonitor:
    """Connection of the service to the agent; as a context manager, it runs the thread that subscribes."""

    def __init__(
        self,
        link: AgentLink,
        publish: Callable[[str, BaseModel | LiveBatch], None],
        observe: Callable[[AgentStatus], None],
    ) -> None:
        """Use a connection to the agent.

        Args:
            link: connection to the agent.
            publish: receives a topic and its message; called in the subscribing thread.
            observe: receives every status; called in the thread that receives it.
        """
        self._link, self._publish, self._observe = link, publish, observe
        self._status: AgentStatus | None = None
        self._status_at = float("-inf")
        self._description: tuple[str, BenchDescription] | None = None
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._listen, name="agent-monitor", daemon=True)

    def __enter__(self) -> "AgentMonitor":
        """Start the subscribing thread."""
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        """Stop the subscribing thread."""
        self.request_end()
        self._thread.join()

    def request_end(self) -> None:
        """Let the subscribing thread end, without waiting for it."""
        self._stopping.set()

    @property
    def last_status(self) -> AgentStatus | None:
        """Last status, however old it is; None before the first."""
        return self._status

    @property
    def latest_status(self) -> AgentStatus | None:
        """Latest status, or None if it was made or has arrived longer ago than `STATUS_LIFETIME`."""
        status = self._status
        if status is None or time.monotonic() - self._status_at > STATUS_LIFETIME:
            return None
        # A message may have waited in a queue, for example while the agent was suspended.
        return status if time.time() - status.utc_s < STATUS_LIFETIME else None

    def get_status(self, timeout: float = 1.0) -> AgentStatus:
        """Return the current status; request it if the latest one is too old.

        Args:
            timeout: time to wait for the reply [s].

        Raises:
            AgentUnreachableError: the agent does not answer.
        """
        return self.latest_status or self.send_command(StatusCommand(), timeout)

    def describe_bench(self) -> BenchDescription:
        """Return what the agent's configuration says about the bench; asked for once for each configuration.

        Raises:
            AgentUnreachableError: the agent does not answer, or is of an older version.
        """
        status, kept = self.latest_status, self._description
        identity = status.config_identity if status else ""
        if kept is not None and identity and kept[0] == identity:
            return kept[1]
        description = self._link.send(DescribeCommand()).description
        if description is None:
            raise AgentUnreachableError(
                "the rig agent cannot describe the bench; it must have the service's version"
            )
        self._description = identity, description
        return description

    def reset(self) -> AgentStatus:
        """Reset a trip.

        Raises:
            AgentUnreachableError: the agent does not answer.
            RunError: the agent refuses the reset.
        """
        return self.send_command(ResetCommand())

    def send_command(self, command: Message, timeout: float = 5.0) -> AgentStatus:
        """Send a command and return the status of the agent after it.

        Raises:
            AgentUnreachableError: the agent does not answer.
            RunError: the agent refuses the command; the message is that of the agent.
        """
        reply = self._link.send(command, timeout)
        if not reply.ok:
            raise RunError(reply.error or "the rig agent refused the command without a reason; see its log")
        if reply.status is None:  # some replies contain no status
            reply = self._link.send(StatusCommand(), timeout)
        if reply.status is None:
            raise AgentUnreachableError(
                "the rig agent replied without a status; it must have the service's version"
            )
        self._set_status(reply.status)
        return reply.status

    def _listen(self) -> None:
        while not self._stopping.is_set():
            try:
                for message in self._link.subscribe(self._stopping):
                    self._handle_message(message)
            except Exception as error:
                # For example a message of another version. Without resubscribing, the agent would seem silent.
                _LOG.warning("agent_message_unused", extra={"why": repr(error)})
                self._stopping.wait(_RETRY_TIME)

    def _handle_message(self, message: PublishedMessage) -> None:
        if isinstance(message, LiveBatch):
            self._publish("samples", message)
        elif isinstance(message, AgentEvent):
            self._publish("event", message)
        elif isinstance(message, AgentStatus):
            self._set_status(message)
            self._publish("status", message)

    def _set_status(self, status: AgentStatus) -> None:
        self._status, self._status_at = status, time.monotonic()
        self._observe(status)

"""Listens to the rig agent: keeps its last status, and passes on what it publishes."""

import logging
import threading
import time
from collections.abc import Callable, Iterator
from typing import Protocol

from pydantic import BaseModel

from bench.agent_protocol import AgentEvent, AgentStatus, Message, Reply, ResetCommand, Samples, StatusCommand
from bench.errors import AgentUnreachableError, RunError

BATCH_TIME = 0.04
"""[s] of samples that go to listeners at once: 25 batches a second."""
STATUS_LIFETIME = 2.0
"""[s] for which a status counts as the present one; the agent sends four a second."""
_RETRY_TIME = 0.5
"""[s] before the agent is listened to anew, after something that cannot be used."""
_LOG = logging.getLogger(__name__)

PublishedMessage = AgentStatus | Samples | AgentEvent | None


class AgentLink(Protocol):
    """A way to the agent; `bench.agent_protocol.link.AgentClient` is one."""

    def send(self, command: Message, timeout: float = 5.0) -> Reply:
        """Send one command and wait for its answer.

        Raises:
            AgentUnreachable: no answer came in time [s].
        """

    def subscribe(self, stopping: threading.Event) -> Iterator[PublishedMessage]:
        """What the agent publishes; None now and then while it is silent."""


class NoAgent:
    """Stands where no agent was named: recordings are still catalogued, identified and shown."""

    _MESSAGE = "the service knows no rig agent; start it with --config bench.toml or --agent ADDRESS"

    def send(self, command: Message, timeout: float = 5.0) -> Reply:
        """Say so.

        Raises:
            AgentUnreachable: always.
        """
        raise AgentUnreachableError(self._MESSAGE)

    def subscribe(self, stopping: threading.Event) -> Iterator[PublishedMessage]:
        """Nothing, until the end."""
        while not stopping.wait(0.5):
            yield None


class AgentMonitor:
    """The agent as the service sees it; a context manager that listens meanwhile."""

    def __init__(
        self,
        link: AgentLink,
        publish: Callable[[str, BaseModel], None],
        observe: Callable[[AgentStatus], None],
    ) -> None:
        """Take the way to the agent.

        Args:
            link: the way.
            publish: takes a topic and its message; called in the listening thread.
            observe: takes every status, in the listening thread.
        """
        self._link, self._publish, self._observe = link, publish, observe
        self._status: AgentStatus | None = None
        self._status_at = float("-inf")
        self._pending: list[Samples] = []
        self._forwarded_at = float("-inf")
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._listen, name="agent-watch", daemon=True)

    def __enter__(self) -> "AgentMonitor":
        """Begin to listen."""
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        """Listen no more."""
        self._stopping.set()
        self._thread.join()

    @property
    def latest_status(self) -> AgentStatus | None:
        """The present status, as far as one came lately."""
        return self._status if time.monotonic() - self._status_at < STATUS_LIFETIME else None

    def get_status(self, timeout: float = 1.0) -> AgentStatus:
        """The present status, asked for where none came lately.

        Args:
            timeout: [s] to wait for the answer.

        Raises:
            AgentUnreachable: it does not answer.
        """
        return self.latest_status or self.send_command(StatusCommand(), timeout)

    def reset(self) -> AgentStatus:
        """Take back a trip.

        Raises:
            AgentUnreachable: it does not answer.
            RunError: it refuses.
        """
        return self.send_command(ResetCommand())

    def send_command(self, command: Message, timeout: float = 5.0) -> AgentStatus:
        """Send a command; the status that its answer carries.

        Raises:
            AgentUnreachable: the agent does not answer.
            RunError: it refuses, in its own words.
        """
        answer = self._link.send(command, timeout)
        if not answer.ok:
            raise RunError(answer.error or "the rig agent refuses, and does not say why")
        if answer.status is None:  # some answers carry none
            answer = self._link.send(StatusCommand(), timeout)
        if answer.status is None:
            raise AgentUnreachableError("the rig agent answers without its status; it is of another version")
        self._set_status(answer.status)
        return answer.status

    def _listen(self) -> None:
        while not self._stopping.is_set():
            try:
                for message in self._link.subscribe(self._stopping):
                    self._handle_message(message)
            except Exception as error:
                # Such as a message of another version. Whoever listens no more sees an agent that never answers.
                _LOG.warning("agent_message_unused", extra={"why": repr(error)})
                self._stopping.wait(_RETRY_TIME)

    def _handle_message(self, message: PublishedMessage) -> None:
        if isinstance(message, Samples):
            self._pending.append(message)
        elif isinstance(message, AgentEvent):
            self._publish("event", message)
        elif isinstance(message, AgentStatus):
            self._set_status(message)
            self._publish("status", message)
        if self._pending and time.monotonic() - self._forwarded_at >= BATCH_TIME:
            self._publish("samples", join_batches(self._pending))
            self._pending, self._forwarded_at = [], time.monotonic()

    def _set_status(self, status: AgentStatus) -> None:
        self._status, self._status_at = status, time.monotonic()
        self._observe(status)


def join_batches(batches: list[Samples]) -> Samples:
    """Several batches as one; a field that one of them lacks is null there."""
    if len(batches) == 1:
        return batches[0]
    names = dict.fromkeys(name for batch in batches for name in batch.values)
    return Samples(
        time_ns=[time_ns for batch in batches for time_ns in batch.time_ns],
        values={
            name: [value for batch in batches for value in batch.values.get(name, [None] * len(batch.time_ns))]
            for name in names
        },
        segment=batches[-1].segment,
    )

"""Connection of the campaigns to the rig agent, whose commands are recorded."""

from collections.abc import Callable

from bench.agent_protocol import AgentStatus, LeaseCommand, Message, RunCommand, SentCommand, get_sender
from bench.audit import Act, redact
from bench.campaigns import AgentConnection
from bench.errors import BenchError


class RecordedConnection:
    """Connection that records each command with its sender and its outcome."""

    def __init__(self, connection: AgentConnection, record: Callable[[Act], None], bench: str) -> None:
        """Use a connection.

        Args:
            connection: connection to the agent.
            record: writes an act to the audit trail.
            bench: name of the bench, for the record.
        """
        self._connection, self._record, self._bench = connection, record, bench
        self._lease: LeaseCommand | None = None

    def get_status(self) -> AgentStatus:
        """Return the current status.

        Raises:
            BenchError: the agent does not answer.
        """
        return self._connection.get_status()

    def send_command(self, command: Message, timeout: float = 5.0) -> AgentStatus:
        """Send a command and return the status after it.

        Raises:
            BenchError: the agent refuses it or does not answer.
        """
        try:
            status = self._connection.send_command(command, timeout)
        except BenchError as error:
            self._note(command, str(error))
            raise
        if command != self._lease:  # the renewal of a lease changes nothing
            self._note(command, "ok")
        if isinstance(command, LeaseCommand):
            self._lease = command
        return status

    def _note(self, command: Message, outcome: str) -> None:
        if isinstance(command, SentCommand):
            sender = get_sender()
            values = command.model_dump(exclude={"command", "sender", "valid_until_utc_s"}, exclude_defaults=True)
            name = (
                "run"
                if isinstance(command, RunCommand)
                else type(command).__name__.removesuffix("Command").lower()
            )
            self._record(
                Act(
                    actor=sender.actor,
                    origin=sender.origin,
                    action=f"{name} by the service",
                    target=self._bench,
                    new=redact(values) if values else None,
                    outcome=outcome,
                )
            )

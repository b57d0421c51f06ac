"""Server of commands: each is answered with one reply, and recorded in the agent's audit trail."""

import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, Protocol

import zmq
from pydantic import TypeAdapter, ValidationError

from bench.agent_protocol.commands import (
    AbortCommand,
    Command,
    PauseCommand,
    SentCommand,
    StopCommand,
    TimedCommand,
)
from bench.agent_protocol.messages import Reply
from bench.agent_protocol.sender import describe_peer
from bench.agent_protocol.sockets import POLL_PERIOD, BoundSocket
from bench.validation import describe_validation_error

CommandHandler = Callable[[Command], Reply]
INVALID_COMMAND: Final = "invalid command"
"""Beginning of the reply to a message that is not a command of this version."""
_COMMAND_ADAPTER: TypeAdapter[Command] = TypeAdapter(Command)


class CommandAudit(Protocol):
    """Audit trail of the commands that reach the agent."""

    def find_obstacle(self, command: SentCommand) -> str:
        """Return why a command must not be executed, because it could not be recorded; empty if it may."""

    def record(self, command: SentCommand | bytes, peer: str, reply: Reply, *, wait: bool) -> None:
        """Record a command with its reply.

        Args:
            command: the command, or a message that is not one.
            peer: its sender as seen at the socket.
            reply: its reply.
            wait: wait a moment until it is on the disk.
        """


class CommandServer(BoundSocket):
    """Server that answers commands in the order of arrival, in the thread that calls `serve`."""

    def __init__(self, address: str, key: Path | None = None) -> None:
        """Listen for commands; arguments and errors as those of every bound socket."""
        super().__init__(zmq.REP, address, key)

    def serve(self, handle: CommandHandler, stopping: threading.Event, audit: CommandAudit | None = None) -> None:
        """Answer until ``stopping`` is set; an invalid command is answered with its error.

        Args:
            handle: executes a command.
            stopping: ends the server.
            audit: records the commands; None for no record.
        """
        while not stopping.is_set():
            if self._socket.poll(POLL_PERIOD):
                self._answer(self._socket.recv(copy=False), handle, audit)

    def _answer(self, frame: zmq.Frame, handle: CommandHandler, audit: CommandAudit | None) -> None:
        """Execute a command and reply; what ends a motion is answered before it is recorded."""
        command, reply = _parse_command(frame.bytes)
        if command is not None:
            reply = _execute(command, handle, audit)
        is_urgent = isinstance(command, StopCommand | AbortCommand | PauseCommand)
        if is_urgent:
            self._send(reply)
        if audit is not None and (command is None or isinstance(command, SentCommand)):
            peer = describe_peer(self.address, _get_peer(frame))
            audit.record(frame.bytes if command is None else command, peer, reply, wait=not is_urgent)
        if not is_urgent:
            self._send(reply)

    def _send(self, reply: Reply) -> None:
        # Clients of an older version refuse a field that they do not know, also that of a stop.
        unknown: dict[str, Any] = {} if reply.audit is not None else {"audit": True}
        if reply.status is not None and reply.status.lease is None:
            unknown["status"] = {"lease"}
        self._socket.send(reply.model_dump_json(exclude=unknown).encode())


def _find_refusal(command: Command) -> str:
    """Return why a command is no longer executed; empty if it is."""
    if not isinstance(command, TimedCommand) or command.valid_until_utc_s is None:
        return ""
    delay = time.time() - command.valid_until_utc_s
    if delay <= 0:
        return ""
    return (
        f"{command.command} was read {delay:.1f} s after its sender gave up; nothing was done; repeat it, and "
        "check the clocks if the sender is on another machine"
    )


def _parse_command(request: bytes) -> tuple[Command | None, Reply]:
    """Return the command in a message; None and the reply if it is not one."""
    try:
        return _COMMAND_ADAPTER.validate_json(request), Reply(ok=True)
    except ValidationError as error:
        fault = describe_validation_error(error, "the message")
        return None, Reply(ok=False, error=f"{INVALID_COMMAND}: {fault}")


def _execute(command: Command, handle: CommandHandler, audit: CommandAudit | None) -> Reply:
    """Execute a command, unless its sender has given up or it could not be recorded."""
    refusal = _find_refusal(command)
    if not refusal and audit is not None and isinstance(command, SentCommand):
        refusal = audit.find_obstacle(command)
    if refusal:
        return Reply(ok=False, error=refusal)
    try:
        return handle(command)
    except Exception as error:  # one faulty command must not end the agent
        return Reply(
            ok=False, error=f"{command.command} failed: {error!r}; internal error of the agent, please report"
        )


def _get_peer(frame: zmq.Frame) -> str:
    try:
        return str(frame.get("Peer-Address"))
    except zmq.ZMQError:  # a transport without addresses
        return ""

"""Client of the agent: sends commands and receives publications."""

import threading
import time
from collections.abc import Iterator
from pathlib import Path

import zmq
from pydantic import ValidationError

from bench.agent_protocol.command_server import INVALID_COMMAND
from bench.agent_protocol.commands import Sender, SentCommand, TimedCommand
from bench.agent_protocol.messages import Message, Reply
from bench.agent_protocol.publications import Publication, parse_publication
from bench.agent_protocol.sender import get_sender
from bench.agent_protocol.sockets import POLL_PERIOD, connect, open_socket
from bench.errors import AgentUnreachableError
from bench.validation import describe_validation_error


class AgentClient:
    """Client of the agent; may be used from any thread, and created before the agent is running."""

    def __init__(self, commands: str, samples: str, key: Path | None = None, sender: Sender | None = None) -> None:
        """Store the addresses; nothing is sent.

        Args:
            commands: address of the agent's request socket.
            samples: address of the agent's publishing socket.
            key: file with the agent's key, needed for TCP; it is read for each connection.
            sender: on whose behalf commands are sent outside of `send_as`; by default the account of this process.
        """
        self._commands, self._samples, self._key, self._sender = commands, samples, key, sender

    def send(self, command: Message, timeout: float = 5.0) -> Reply:
        """Send one command and wait for its reply.

        Args:
            command: one of `bench.agent_protocol.commands.Command`.
            timeout: [s]

        Raises:
            AgentUnreachableError: address or key is invalid, or no valid reply came in time.
        """
        if isinstance(command, SentCommand) and command.sender is None:
            stated = command.model_copy(update={"sender": get_sender(self._sender)})
            reply = self._exchange(_limit_validity(stated, timeout), timeout)
            # An agent that was started by an older version knows no senders, and must still stop.
            if reply.ok or not (reply.error.startswith(INVALID_COMMAND) and ".sender: no such key" in reply.error):
                return reply
        return self._exchange(_limit_validity(command, timeout), timeout)

    def _exchange(self, command: Message, timeout: float) -> Reply:
        # One socket per command, because a request socket without its reply cannot be used again.
        with open_socket(zmq.REQ) as socket:
            connect(socket, self._commands, self._key)
            socket.send(command.model_dump_json().encode())
            if not socket.poll(round(timeout * 1e3)):
                key = f", or check that {self._key} is its key" if self._commands.startswith("tcp://") else ""
                raise AgentUnreachableError(
                    f"no rig agent replied at {self._commands} within {timeout:g} s; start one: mrbench rig{key}"
                )
            try:
                return Reply.model_validate_json(socket.recv())
            except ValidationError as error:
                raise AgentUnreachableError(
                    f"the process at {self._commands} is not a rig agent of this version "
                    f"({describe_validation_error(error, 'the reply')}); end it and start one: mrbench rig"
                ) from error

    def subscribe(self, stopping: threading.Event) -> Iterator[Publication | None]:
        """Yield the agent's publications until ``stopping`` is set, and None after each 0.1 s of silence.

        Raises:
            AgentUnreachableError: address or key is invalid.
            LiveDataError: samples of another version.
        """
        with open_socket(zmq.SUB) as socket:
            socket.subscribe(b"")
            connect(socket, self._samples, self._key)
            while not stopping.is_set():
                if not socket.poll(POLL_PERIOD):
                    yield None
                    continue
                yield parse_publication(socket.recv_multipart())


def _limit_validity(command: Message, timeout: float) -> Message:
    """Return a command that is not executed after its sender has given up."""
    if not isinstance(command, TimedCommand):
        return command
    return command.model_copy(update={"valid_until_utc_s": time.time() + timeout})

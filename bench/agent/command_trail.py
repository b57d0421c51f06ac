"""Audit trail of the agent: every command that reached it, local ones and those of a service alike."""

from concurrent.futures import TimeoutError as FutureTimeoutError
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Final

from bench.agent_protocol import (
    AuditCommand,
    AuditPage,
    LeaseCommand,
    PrepareCommand,
    Reply,
    ResetCommand,
    RunCommand,
    Sender,
    SentCommand,
    get_sender,
)
from bench.audit import Act, AuditWriter, parse_entry, read_after, read_chain_id, redact
from bench.errors import AuditError

WRITE_TIMEOUT: Final = 0.5
"""[s] Longest time for which a reply waits for the disk."""
PAGE_LENGTH: Final = 200
"""Largest number of entries in a reply."""
_REFUSED_UNRECORDED = RunCommand | PrepareCommand | ResetCommand
"""Commands that are refused if they could not be recorded; whatever ends a motion is always executed."""
_FACTS = frozenset(("command", "sender", "valid_until_utc_s"))
"""Fields of a command that are no values."""
_UNKNOWN = Sender(actor="unknown", origin="")


class CommandTrail:
    """Audit trail of one agent; as a context manager, it runs the thread that writes."""

    def __init__(self, path: Path) -> None:
        """Use a file; it is created with the first entry."""
        self._path = path
        self._writer = AuditWriter(path)
        self._chain = ""
        self._lease: LeaseCommand | None = None

    def __enter__(self) -> "CommandTrail":
        """Start to write, and record the start of the agent."""
        self._writer.__enter__()
        self._note("agent start")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Record the end of the agent, and write what waits."""
        self._note("agent end", "ok" if error is None else str(error))
        self._writer.__exit__(kind, error, trace)

    def find_obstacle(self, command: SentCommand) -> str:
        """Return why a command must not be executed, because it could not be recorded; empty if it may."""
        if not isinstance(command, _REFUSED_UNRECORDED):
            return ""
        obstacle = self._writer.find_obstacle()
        return f"{obstacle}; nothing was started, because it could not be recorded" if obstacle else ""

    def record(self, command: SentCommand | bytes, peer: str, reply: Reply, *, wait: bool) -> None:
        """Record a command with its reply; a disk that stalls delays the reply by `WRITE_TIMEOUT` at most.

        The renewal of a lease is left out, because it comes every few seconds and changes nothing.
        """
        if isinstance(command, LeaseCommand) and reply.ok:
            is_renewal, self._lease = command == self._lease, command
            if is_renewal:
                return
        is_stalled = bool(self._writer.find_obstacle())
        written = self._writer.record(_make_act(command, peer, reply))
        if wait and not is_stalled:
            with suppress(FutureTimeoutError, AuditError):
                written.result(WRITE_TIMEOUT)

    def read_page(self, command: AuditCommand) -> AuditPage:
        """Return the entries that follow those of a client; none if it knows another chain.

        Raises:
            AuditError: the file cannot be read.
        """
        chain = self._find_chain()
        if command.chain != chain:
            return AuditPage(chain=chain, before="", lines=())
        # The entry that the client has already is read again, to compare its hash.
        lines = read_after(self._path, max(0, command.after - 1), PAGE_LENGTH)
        first = parse_entry(lines[0].encode()) if lines and command.after else None
        is_known = first is not None and first.seq == command.after
        return AuditPage(
            chain=chain,
            before=first.sha256 if first is not None and is_known else "",
            lines=tuple(lines[1:] if is_known else lines),
        )

    def _find_chain(self) -> str:
        if not self._chain:
            self._chain = read_chain_id(self._path)
        return self._chain

    def _note(self, action: str, outcome: str = "ok") -> None:
        sender = get_sender()
        self._writer.record(Act(actor=sender.actor, action=action, outcome=outcome))


def _make_act(command: SentCommand | bytes, peer: str, reply: Reply) -> Act:
    outcome = "ok" if reply.ok else reply.error
    if isinstance(command, bytes):
        text = command.decode("utf-8", "backslashreplace")
        return Act(actor="unknown", origin="", peer=peer, action="message", new=redact(text), outcome=outcome)
    # A client of an older version does not say on whose behalf it acts.
    sender = command.sender or _UNKNOWN
    values = command.model_dump(exclude=set(_FACTS), exclude_defaults=True)
    return Act(
        actor=sender.actor,
        origin=sender.origin,
        peer=peer,
        request=sender.request,
        action=getattr(command, "command", "message"),
        target=_find_target(command, reply),
        new=redact(values) if values else None,
        outcome=str(redact(outcome)),
    )


def _find_target(command: SentCommand, reply: Reply) -> str:
    """Return the run that a command has affected; empty without one."""
    run = reply.status.run if reply.status is not None else None
    if isinstance(command, RunCommand) or run is None:
        return ""  # the run has no id yet
    return run.id if run.outcome is None else ""

"""Audit trail of the agent: every command, with who sent it, over a real socket; a full disk stops no stop."""

import errno
import os
import pwd
import threading

import pytest
import zmq

from bench.agent import CommandTrail
from bench.agent_protocol import (
    AbortCommand,
    AgentClient,
    AgentStatus,
    AuditCommand,
    CommandServer,
    DescribeCommand,
    LeaseCommand,
    PauseCommand,
    PrepareCommand,
    Reply,
    ResetCommand,
    RunCommand,
    Sender,
    ShutDownCommand,
    StatusCommand,
    StopCommand,
    send_as,
)
from bench.audit import verify_chain
from tests.support.audit_trails import list_all, wait_for

ACCOUNT = pwd.getpwuid(os.getuid()).pw_name
COMMANDS = (
    RunCommand(method={"name": "polka"}, specimen="d1"), PrepareCommand(step="home"), ResetCommand(),
    PauseCommand(), StopCommand(), AbortCommand(), ShutDownCommand(),
)  # fmt: skip


class Bench:
    """Command server with an audit trail, and a handler that refuses what the test names."""

    def __init__(self, folder):
        (folder / "sockets").mkdir(mode=0o700)
        self.path, self.address = folder / "logs" / "bench.audit.jsonl", f"ipc://{folder}/sockets/agent"
        self.handled, self.refused = [], {}
        self.stopping = threading.Event()

    def __enter__(self):
        self.trail = CommandTrail(self.path).__enter__()
        self.server = CommandServer(self.address).__enter__()
        self.thread = threading.Thread(target=self.server.serve, args=(self.handle, self.stopping, self.trail))
        self.thread.start()
        self.client = AgentClient(self.address, "")
        return self

    def __exit__(self, *_):
        self.stopping.set()
        self.thread.join()
        self.server.__exit__(None, None, None)
        self.trail.__exit__(None, None, None)
        self.stopping.clear()

    def handle(self, command):
        self.handled.append(command.command)
        if isinstance(command, AuditCommand):
            return Reply(ok=True, audit=self.trail.read_page(command))
        error = self.refused.get(command.command, "")
        return Reply(ok=not error, error=error, status=AgentStatus(state="idle"))

    def list_acts(self):
        """Return the entries without the first one, and without those of start and end."""
        return [one for one in list_all(self.path)[1:] if not one.action.startswith("agent ")]


@pytest.fixture
def bench(tmp_path):
    with Bench(tmp_path) as bench:
        yield bench


def test_every_command_that_changes_something_is_recorded_with_its_sender_and_outcome(bench):
    bench.refused["reset"] = "the limit is still exceeded"
    for command in COMMANDS:
        bench.client.send(command)
    bench.client.send(StatusCommand())
    bench.client.send(DescribeCommand())
    bench.__exit__()
    entries = bench.list_acts()
    assert [one.action for one in entries] == [one.command for one in COMMANDS]
    assert {one.actor for one in entries} == {f"local:{ACCOUNT}"}
    assert {one.peer for one in entries} == {f"account {ACCOUNT}, process {os.getpid()}"}
    assert [one.outcome for one in entries if one.action == "reset"] == ["the limit is still exceeded"]
    assert entries[0].new == {"method": {"name": "polka"}, "specimen": "d1"}
    assert entries[1].new == {"step": "home"}
    assert not verify_chain(bench.path).fault
    bench.__enter__()


def test_a_lease_is_recorded_when_it_begins_and_ends_and_not_when_it_is_renewed(bench):
    begin, end = (LeaseCommand(description="campaign 1", duration_s=time) for time in (15, 0))
    for command in (begin, begin, begin, end, begin):
        bench.client.send(command)
    bench.refused["lease"] = "campaign 2 holds the bench"
    for command in (begin, begin):
        bench.client.send(command)
    bench.__exit__()
    entries = bench.list_acts()
    assert [one.new["duration_s"] for one in entries] == [15, 0, 15, 15, 15]
    assert [one.outcome for one in entries] == ["ok"] * 3 + ["campaign 2 holds the bench"] * 2
    bench.__enter__()


def test_a_service_states_on_whose_behalf_it_sends(bench):
    with send_as(lambda: Sender(actor="user:mcurie", origin="10.0.0.9", request="r1")):
        bench.client.send(PrepareCommand(step="home"))
    AgentClient(bench.address, "", sender=Sender(actor="service")).send(PrepareCommand(step="tare"))
    first, second = bench.list_acts()
    assert (first.actor, first.origin, first.request) == ("user:mcurie", "10.0.0.9", "r1")
    assert (second.actor, second.origin) == ("service", "local")


def test_what_is_refused_before_it_is_executed_is_recorded_too(bench):
    with zmq.Context.instance().socket(zmq.REQ) as client:
        client.linger = 0
        client.connect(bench.address)
        for message in (b"nonsense", RunCommand(method={}, valid_until_utc_s=1.0).model_dump_json().encode()):
            client.send(message)
            assert not Reply.model_validate_json(client.recv()).ok
    late, nonsense = bench.list_acts()[::-1]
    assert (nonsense.action, nonsense.new) == ("message", "nonsense")
    assert nonsense.outcome.startswith("invalid command")
    assert (late.action, late.actor) == ("run", "unknown")
    assert "nothing was done; repeat it" in late.outcome
    assert bench.handled == []


def test_an_agent_of_an_older_version_still_stops():
    sent = []

    class OlderAgent(AgentClient):
        def _exchange(self, command, timeout):
            sent.append(command)
            if command.sender is not None:
                return Reply(ok=False, error="invalid command: stop.sender: no such key; check its spelling")
            return Reply(ok=True, status=AgentStatus(state="stopping"))

    assert OlderAgent("", "").send(StopCommand()).ok
    assert [one.sender is None for one in sent] == [False, True]


def test_a_full_disk_refuses_what_begins_something_and_delays_no_stop(bench, monkeypatch):
    def refuse(file):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    bench.client.send(PrepareCommand(step="home"))
    monkeypatch.setattr(os, "fsync", refuse)
    assert bench.client.send(StopCommand()).ok
    wait_for(lambda: bench.trail.find_obstacle(ResetCommand()))
    for command in (RunCommand(method={}), PrepareCommand(step="home"), ResetCommand()):
        reply = bench.client.send(command)
        assert "No space left on device" in reply.error
        assert "nothing was started, because it could not be recorded" in reply.error
    for command in (StopCommand(), AbortCommand(), PauseCommand()):
        assert bench.client.send(command, timeout=0.4).ok
    assert bench.handled == ["prepare", "stop", "stop", "abort", "pause"]
    monkeypatch.undo()
    bench.__exit__()
    assert [one.action for one in bench.list_acts()] == [
        "prepare", "stop", "run", "prepare", "reset", "stop", "abort", "pause"
    ]  # fmt: skip
    bench.__enter__()


def test_pages_follow_what_the_client_has(bench, monkeypatch):
    monkeypatch.setattr("bench.agent.command_trail.PAGE_LENGTH", 3)
    for _ in range(6):
        bench.client.send(PrepareCommand(step="home"))
    entries = list_all(bench.path)
    chain, seqs, after = entries[0].new, [], 0
    assert bench.client.send(AuditCommand()).audit.lines == ()
    while (page := bench.client.send(AuditCommand(chain=chain, after=after)).audit).lines:
        assert page.before == (entries[after - 1].sha256 if after else "")
        seqs += [entry.seq for entry in entries if entry.to_line().decode().strip() in page.lines]
        after = seqs[-1]
    assert seqs == [one.seq for one in entries]
    assert page.before == entries[-1].sha256
    assert bench.client.send(AuditCommand(chain=chain, after=99)).audit.before == ""
    assert bench.client.send(AuditCommand(chain="other", after=0)).audit == page.model_copy(update={"before": ""})


def test_start_and_end_of_the_agent_are_recorded(bench):
    bench.__exit__()
    bench.__enter__()
    bench.client.send(PrepareCommand(step="home"))
    actions = [one.action for one in list_all(bench.path)]
    assert actions == ["chain begun", "agent start", "agent end", "agent start", "prepare"]

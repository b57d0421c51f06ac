"""Import of the rig agent's trail: each entry once, whatever is killed, and alterations are noticed."""

import pytest

from bench.agent import CommandTrail
from bench.agent_protocol import AgentStatus, PrepareCommand, Reply, Sender, StopCommand
from bench.audit import AuditChain, AuditWriter, compare_imports, verify_chain
from bench.errors import AgentUnreachableError, BenchError
from bench.service.audit import AgentImport
from tests.support.audit_trails import list_all, make_act

DONE = Reply(ok=True, status=AgentStatus(state="idle"))
ADA = Sender(actor="local:ada")


class Benches:
    """Trails of an agent and of a service in one folder; both can be restarted."""

    def __init__(self, folder):
        self.agent, self.own = folder / "agent.jsonl", folder / "audit.jsonl"
        self.is_reachable = True
        self.trail = CommandTrail(self.agent).__enter__()
        self.writer = AuditWriter(self.own).__enter__()
        self.importer = self.make_import()

    def make_import(self):
        return AgentImport(self.own, self.send, self.writer.record)

    def send(self, command):
        if not self.is_reachable:
            raise AgentUnreachableError("nobody")
        return Reply(ok=True, audit=self.trail.read_page(command))

    def command(self, count=1):
        for _ in range(count):
            self.trail.record(PrepareCommand(step="home", sender=ADA), "account ada, process 7", DONE, wait=True)

    def restart_agent(self):
        self.trail.__exit__(None, None, None)
        self.trail = CommandTrail(self.agent).__enter__()

    def end(self):
        self.trail.__exit__(None, None, None)
        self.writer.__exit__(None, None, None)

    def list_imported(self):
        self.importer._has_written()
        return [one for one in list_all(self.own) if one.source is not None]


@pytest.fixture
def benches(tmp_path):
    made = Benches(tmp_path)
    yield made
    made.end()


def import_all(benches):
    benches.importer.import_new()
    return benches.list_imported()


def test_entries_are_imported_with_their_place_in_the_chain_of_the_agent(benches):
    benches.command(3)
    imported, own = import_all(benches), list_all(benches.agent)
    assert [one.source.sha256 for one in imported] == [one.sha256 for one in own]
    assert [(one.actor, one.action, one.utc, one.peer) for one in imported] == [
        (one.actor, one.action, one.utc, one.peer) for one in own
    ]
    result = verify_chain(benches.own)
    assert (result.fault, compare_imports(result, benches.agent)) == ("", "")


def test_nothing_is_imported_twice_or_left_out_over_restarts(benches, monkeypatch):
    monkeypatch.setattr("bench.agent.command_trail.PAGE_LENGTH", 3)
    for number in range(5):
        benches.command(2)
        if number % 2:
            benches.restart_agent()
        import_all(benches)
        benches.importer = benches.make_import()  # as after a kill of the service: it remembers nothing
    benches.command(1)
    imported = import_all(benches)
    assert [one.source.seq for one in imported] == list(range(1, len(list_all(benches.agent)) + 1))
    assert not verify_chain(benches.own).fault


def test_a_service_that_is_killed_between_two_entries_of_a_page_goes_on_after_the_first(benches):
    benches.command(4)
    import_all(benches)
    benches.writer.__exit__(None, None, None)
    lines = benches.own.read_bytes().splitlines(keepends=True)
    benches.own.write_bytes(b"".join(lines[:-2]) + lines[-2][:30])  # as the disk has it after a power failure
    benches.writer = AuditWriter(benches.own).__enter__()
    benches.importer = benches.make_import()
    imported = import_all(benches)
    assert [one.source.seq for one in imported] == list(range(1, len(list_all(benches.agent)) + 1))
    assert not verify_chain(benches.own).fault


def test_an_absent_agent_is_no_fault(benches):
    benches.is_reachable = False
    assert benches.importer.import_new() == 0
    assert benches.importer.obstacle == ""


def test_an_agent_of_an_older_version_is_reported(benches):
    benches.importer._send = lambda command: Reply(ok=False, error="invalid command")
    with pytest.raises(BenchError, match=r"is replaced after: mrbench rig --end"):
        benches.importer.import_new()


@pytest.mark.parametrize("kept", [2, 4])
def test_a_cut_trail_of_the_agent_is_noticed_recorded_once_and_not_imported(benches, kept):
    benches.command(4)
    before = import_all(benches)
    benches.trail.__exit__(None, None, None)
    lines = benches.agent.read_bytes().splitlines(keepends=True)
    benches.agent.write_bytes(b"".join(lines[:kept]))
    for _ in range(4):
        AuditChain(benches.agent).append(list_all(benches.agent)[0].model_copy(update={"action": "stop"}))
    benches.trail = CommandTrail(benches.agent).__enter__()
    for _ in range(2):
        assert len(import_all(benches)) == len(before)
    assert "the rig agent's own audit trail was altered: its entry 6" in benches.importer.obstacle
    benches.writer.record(make_act()).result(5)  # those before it are on the disk, too
    notes = [one for one in list_all(benches.own) if one.action == "rig agent's audit trail broken"]
    assert len(notes) == 1
    assert not verify_chain(benches.own).fault


def test_a_new_trail_after_the_old_one_was_moved_away_is_imported(benches):
    benches.command(2)
    first = import_all(benches)
    benches.trail.__exit__(None, None, None)
    benches.agent.rename(benches.agent.with_name("kept.jsonl"))
    benches.trail = CommandTrail(benches.agent).__enter__()
    benches.trail.record(StopCommand(sender=ADA), "", DONE, wait=True)
    imported = import_all(benches)[len(first) :]
    assert [one.action for one in imported] == ["chain begun", "agent start", "stop"]
    assert not verify_chain(benches.own).fault


def test_a_service_shows_what_was_stopped_while_it_was_down(service, tmp_path):
    service.end()
    with CommandTrail(tmp_path / "agent" / "bench.audit.jsonl") as trail:
        trail.record(StopCommand(sender=ADA), "account ada, process 7", DONE, wait=True)
        service.agent.trail = trail
        service.start()
        page = service.wait_for("/audit?action=stop&actor=local:ada", lambda page: page["items"])
        assert page["items"][0]["source"]["seq"] == 3
        assert service.get("/health")["audit"] == "ok"
        service.end()

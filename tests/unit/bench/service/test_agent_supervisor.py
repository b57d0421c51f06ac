"""Supervision of the rig agent, on a controlled clock."""

import logging
import subprocess
import sys

import pytest

from bench.agent_protocol import AgentStatus, Reply, ShutDownCommand, StatusCommand
from bench.config import compute_identity, load_config
from bench.errors import AgentUnreachableError
from bench.service.agent_supervisor import MAX_RESTART_PAUSE, SupervisedAgent
from tests.support.fake_rig import BENCH_TOML

SILENCE = "no rig agent replied; start one: mrbench rig"


class Bench:
    """A bench.toml, an agent that answers with a status or not at all, and agents that end at once."""

    def __init__(self, folder):
        self.config, self.log = folder / "bench.toml", folder / "agent.log"
        self.config.write_text(BENCH_TOML)
        self.now, self.sent, self.started, self.processes = 1000.0, [], [], []
        self.status = self.make_status("idle")
        self.code = "import sys; print('mrbench: load_cell does not reply'); sys.exit(1)"

    def make_status(self, state, **more):
        return AgentStatus(state=state, config_identity=compute_identity(load_config(self.config)), **more)

    def send(self, command, timeout=5.0):
        self.sent.append(command)
        if self.status is None:
            raise AgentUnreachableError(SILENCE)
        return Reply(ok=True, status=self.status)

    def subscribe(self, stopping):
        yield self.status

    def start(self):
        with self.log.open("a") as output:
            self.processes.append(subprocess.Popen([sys.executable, "-c", self.code], stdout=output))
        self.started.append(self.now)
        return self.processes[-1]

    def wait_and_check(self, agent, seconds=2.0):
        self.now += seconds
        agent.check(self.now)

    def change_config(self):
        self.config.write_text(BENCH_TOML + '\n[rig]\nname = "another"\n')


@pytest.fixture
def bench(tmp_path, monkeypatch):
    bench = Bench(tmp_path)
    monkeypatch.setattr("bench.service.agent_supervisor.time.monotonic", lambda: bench.now)
    yield bench
    for process in bench.processes:
        process.kill()
        process.wait()


@pytest.fixture
def agent(bench):
    process = bench.start()
    bench.started.clear()
    return SupervisedAgent(bench.config, bench, bench.log, bench.start, process)


def test_an_agent_that_a_person_has_ended_is_not_explained_by_its_last_line(bench, agent):
    bench.code, bench.status = "print('agent of bench: commands ipc:///a')", None
    agent._process.wait()
    bench.wait_and_check(agent)
    bench.processes[-1].wait()
    bench.wait_and_check(agent)
    with pytest.raises(AgentUnreachableError, match="ended: it was asked to end; it is started again within 30 s"):
        agent.send(StatusCommand())


def test_a_dead_agent_is_started_again_and_its_death_logged_with_the_reason(bench, agent, caplog):
    caplog.set_level(logging.INFO, "bench.service.agent_supervisor")
    agent._process.wait()
    bench.status = None
    bench.wait_and_check(agent)
    assert bench.started == [1002.0]
    assert [record.why for record in caplog.records if record.message == "agent_ended"] == [
        "load_cell does not reply"
    ]
    with pytest.raises(
        AgentUnreachableError, match="the rig agent ended: load_cell does not reply; it is started"
    ):
        agent.send(StatusCommand())


def test_the_reason_of_a_killed_agent_is_its_signal(bench, agent):
    bench.code = "import time; time.sleep(60)"
    agent._process = bench.start()
    agent._process.kill()
    agent._process.wait()
    bench.status = None
    bench.wait_and_check(agent)
    with pytest.raises(AgentUnreachableError, match="ended: killed by SIGKILL"):
        agent.send(StatusCommand())


def test_the_pauses_between_starts_grow_and_shrink_after_a_long_life(bench, agent):
    bench.status = None
    for _ in range(100):
        if agent._process is not None:
            agent._process.wait()
        bench.wait_and_check(agent)
    pauses = [later - earlier for earlier, later in zip(bench.started, bench.started[1:], strict=False)]
    assert pauses[:4] == [2.0, 2.0, 4.0, 8.0]
    assert max(pauses) == MAX_RESTART_PAUSE
    assert len(bench.started) < 12
    bench.status = bench.make_status("idle")
    bench.wait_and_check(agent, 2 * MAX_RESTART_PAUSE)
    bench.status = None
    if agent._process is not None:
        agent._process.wait()
    before = len(bench.started)
    bench.wait_and_check(agent)
    bench.wait_and_check(agent, 8.0)
    assert len(bench.started) > before


def test_an_agent_that_does_not_reply_but_lives_is_not_started_twice(bench, agent):
    bench.code = "import time; time.sleep(60)"
    agent._process = bench.start()
    bench.started.clear()
    bench.status = None
    for _ in range(20):
        bench.wait_and_check(agent)
    assert bench.started == []
    with pytest.raises(AgentUnreachableError, match=r"process \d+\) does not reply; see"):
        agent.send(StatusCommand())


def test_an_agent_that_another_service_has_started_is_replaced_after_a_longer_silence(bench):
    agent = SupervisedAgent(bench.config, bench, bench.log, bench.start)
    bench.wait_and_check(agent)
    bench.status = None
    bench.wait_and_check(agent)
    assert bench.started == []
    bench.wait_and_check(agent, 4.0)
    assert len(bench.started) == 1
    agent._process.wait()


def test_without_the_right_to_start_an_absent_agent_is_only_reported(bench):
    agent = SupervisedAgent(bench.config, bench, bench.log, None)
    bench.status = None
    bench.wait_and_check(agent, 60.0)
    with pytest.raises(AgentUnreachableError, match="start one: mrbench rig"):
        agent.send(StatusCommand())


class TestConfiguration:
    """An agent whose bench.toml has changed."""

    def test_the_present_one_needs_nothing(self, bench, agent):
        bench.config.write_text(f"# a comment\n{BENCH_TOML}")
        bench.wait_and_check(agent)
        assert bench.sent == [StatusCommand()]
        assert agent.send(StatusCommand()).status.notice == ""

    def test_an_idle_agent_is_ended_so_that_another_is_started(self, bench, agent):
        bench.change_config()
        bench.wait_and_check(agent)
        assert bench.sent == [StatusCommand(), ShutDownCommand()]
        agent._process.wait()
        bench.status = None
        bench.wait_and_check(agent)
        assert len(bench.started) == 1

    @pytest.mark.parametrize(
        ("state", "advice"), [("running", "as soon as it is idle"), ("tripped", "mrbench rig --end --force")]
    )
    def test_a_busy_or_tripped_agent_is_named_in_its_status(self, bench, agent, state, advice):
        bench.status = bench.make_status(state)
        bench.change_config()
        bench.wait_and_check(agent)
        assert bench.sent == [StatusCommand()]
        for status in (agent.send(StatusCommand()).status, next(agent.subscribe(None))):
            assert advice in status.notice
            assert status.warnings == (status.notice,)

    def test_an_invalid_file_is_named_and_the_agent_kept(self, bench, agent):
        bench.config.write_text("instruments = 3")
        bench.wait_and_check(agent)
        assert bench.sent == [StatusCommand()]
        assert "keeps its former configuration" in agent.send(StatusCommand()).status.notice

    def test_other_addresses_need_a_new_start_of_the_service(self, bench, agent):
        bench.config.write_text(BENCH_TOML + '\n[agent]\ncommands = "tcp://127.0.0.1:7000"\n')
        bench.wait_and_check(agent)
        assert bench.sent == [StatusCommand()]
        assert "start the service again" in agent.send(StatusCommand()).status.notice

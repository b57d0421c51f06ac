"""Requests that end a run, a setup step, or the agent."""

import pytest

from bench.agent_protocol import (
    AbortCommand,
    AgentStatus,
    Reply,
    RunStatus,
    SetupStatus,
    ShutDownCommand,
    StatusCommand,
    StopCommand,
)
from bench.agent_protocol import stop_client as module
from bench.agent_protocol.stop_client import request_end, request_stop
from bench.errors import AgentUnreachableError, RunError
from tests.support.fake_rig import BENCH_TOML
from tests.unit.bench.agent_protocol.test_setup_client import ScriptedAgent

SILENCE = AgentUnreachableError("no rig agent replied")


def status(state, **more):
    return AgentStatus(state=state, **more)


def run(outcome=None, **more):
    return RunStatus(
        id="run-1", method="quick", specimen="", operator="", log="run-1.mcap", started="", duration_s=20.0,
        outcome=outcome, **more,
    )  # fmt: skip


STOPPED = run("incomplete", ending="stopped", reason="stopped on request")


@pytest.fixture
def config(tmp_path, monkeypatch):
    path = tmp_path / "bench.toml"
    path.write_text(BENCH_TOML)
    monkeypatch.setattr(module.time, "sleep", lambda period: None)
    return path


@pytest.fixture
def connect(monkeypatch):
    def connect(*replies):
        agent = ScriptedAgent(*replies)
        monkeypatch.setattr(module, "AgentClient", lambda *endpoint: agent)
        return agent

    return connect


def test_a_stop_waits_for_the_end_of_the_run_and_says_how_it_ended(config, connect):
    agent = connect(status("stopping", run=run()), status("stopping", run=run()), status("idle", run=STOPPED))
    assert request_stop(config) == "run-1: stopped (stopped on request); log run-1.mcap"
    assert agent.commands == [StopCommand(), StatusCommand(), StatusCommand()]


def test_the_agent_of_a_single_run_ends_with_it(config, connect):
    connect(status("stopping", run=run()), SILENCE)
    assert request_stop(config) == "run-1: ended; log run-1.mcap; its agent has ended with it"


def test_an_abort_waits_for_the_log_of_the_tripped_run(config, connect):
    agent = connect(
        status("tripped", trip="aborted by a person", run=run()),
        status("tripped", trip="aborted by a person", run=STOPPED),
    )
    assert request_stop(config, abort=True).startswith("tripped: aborted by a person; remove the cause")
    assert agent.commands == [AbortCommand(), StatusCommand()]


def test_a_stop_of_a_setup_step_reports_the_step(config, connect):
    step = SetupStatus(step="home", outcome="failed", message="stopped on request")
    connect(status("preparing", run=STOPPED), status("idle", step=step, run=STOPPED))
    assert request_stop(config) == "the setup step has ended: stopped on request"


def test_a_stop_of_an_idle_bench_is_harmless(config, connect):
    connect(status("idle", run=STOPPED))
    assert request_stop(config) == "nothing was in progress; the rig agent is idle"


def test_an_idle_agent_is_ended(config, connect):
    agent = connect(status("idle"), Reply(ok=True), status("idle"), SILENCE)
    assert request_end(config) == "the rig agent was idle and has ended"
    assert agent.commands[1] == ShutDownCommand()


@pytest.mark.parametrize(
    ("reply", "message"),
    [
        (status("running", run=run()), "is running and was not ended; stop it first: mrbench stop"),
        (status("tripped", trip="force 1600 N"), r"is tripped \(force 1600 N\) and was not ended; .* --force"),
    ],
)
def test_a_busy_or_tripped_agent_is_not_ended(config, connect, reply, message):
    agent = connect(reply)
    with pytest.raises(RunError, match=message):
        request_end(config)
    assert agent.commands == [StatusCommand()]


def test_a_tripped_agent_is_ended_by_force(config, connect):
    connect(status("tripped", trip="force 1600 N"), Reply(ok=True), SILENCE)
    assert request_end(config, force=True) == "the rig agent was tripped and has ended"

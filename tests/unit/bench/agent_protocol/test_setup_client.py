"""Request of a setup step: replies of the agent, and an interrupt."""

import pytest

from bench.agent_protocol import (
    AgentStatus,
    PrepareCommand,
    Reply,
    SetupStatus,
    StatusCommand,
    StopCommand,
)
from bench.agent_protocol import setup_client as module
from bench.agent_protocol.setup_client import request_setup_step
from bench.errors import RunError
from tests.support.fake_rig import BENCH_TOML


def status(state, outcome, message="", **more):
    return AgentStatus(
        state=state,
        reference_state="homed",
        step=SetupStatus(step="home", outcome=outcome, message=message),
        **more,
    )


class ScriptedAgent:
    """Agent that returns one status or reply per command, or raises an exception."""

    def __init__(self, *replies):
        self.replies, self.commands = list(replies), []

    def send(self, command, timeout=5.0):
        self.commands.append(command)
        reply = self.replies.pop(0)
        if isinstance(reply, BaseException):
            raise reply
        return reply if isinstance(reply, Reply) else Reply(ok=True, status=reply)


@pytest.fixture
def request_step(tmp_path, monkeypatch):
    config = tmp_path / "bench.toml"
    config.write_text(BENCH_TOML)

    def request(agent):
        monkeypatch.setattr(module, "AgentClient", lambda *endpoint: agent)
        return request_setup_step(config, "home", poll_period=0.0)

    return request


def test_step_ends_when_the_agent_accepts_the_next_one(request_step):
    agent = ScriptedAgent(
        status("preparing", "running"), status("preparing", "done", "at home"), status("idle", "done", "at home")
    )
    assert request_step(agent) == "homed: at home"
    assert agent.commands == [PrepareCommand(step="home"), StatusCommand(), StatusCommand()]


@pytest.mark.parametrize(
    ("replies", "message"),
    [
        ([Reply(ok=False, error="the agent is running; nothing was started")], "is running"),
        ([status("preparing", "running"), status("idle", "failed", "no reference")], "no reference"),
        (
            [status("preparing", "running"), status("tripped", "failed", "no setpoints", trip="force 1600 N")],
            "force 1600 N",
        ),
        ([status("preparing", "running"), AgentStatus(state="idle")], "was restarted"),
    ],
)
def test_failed_step_is_an_error_with_its_reason(request_step, replies, message):
    with pytest.raises(RunError, match=message):
        request_step(ScriptedAgent(*replies))


@pytest.mark.parametrize("before", [[], [status("preparing", "running")]])
def test_interrupt_stops_the_rod(request_step, before):
    agent = ScriptedAgent(*before, KeyboardInterrupt(), Reply(ok=True))
    with pytest.raises(KeyboardInterrupt):
        request_step(agent)
    assert agent.commands[-1] == StopCommand()

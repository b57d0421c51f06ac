"""A step asked of an agent, whatever it answers and whoever grows impatient."""

import pytest

from bench.agent import prepare as asking
from bench.agent.messages import AgentStatus, Answer, PrepareCommand, StatusCommand, StepStatus, StopCommand
from bench.agent.prepare import prepare_through_agent
from bench.errors import RunError


def status(state, outcome, words="", **more):
    return AgentStatus(
        state=state, mounting="homed", step=StepStatus(step="home", outcome=outcome, words=words), **more
    )


class Agent:
    """Answers commands one after the other as it was told to; what is an exception happens meanwhile."""

    def __init__(self, *answers):
        self.answers, self.asked = list(answers), []

    def send(self, command, timeout=5.0):
        self.asked.append(command)
        found = self.answers.pop(0)
        if isinstance(found, BaseException):
            raise found
        return found if isinstance(found, Answer) else Answer(ok=True, status=found)


@pytest.fixture
def step(tmp_path, monkeypatch):
    config = tmp_path / "bench.toml"
    config.write_text(
        "[instruments]\n"
        'drive = { driver = "actuator", interface = "socketcan" }\n'
        'cell = { driver = "load_cell", url = "/dev/ttyUSB0" }\n'
        'lvdt = { driver = "lvdt", url = "tcp://10.0.0.6" }\n'
        'coil = { driver = "coil_amplifier", url = "tcp://10.0.0.7" }\n'
    )
    monkeypatch.setattr(asking, "_LOOK", 0.0)

    def asked_of(agent):
        monkeypatch.setattr(asking, "AgentClient", lambda commands, samples: agent)
        return prepare_through_agent(config, "home")

    return asked_of


def test_a_step_is_over_when_the_agent_takes_the_next_one(step):
    agent = Agent(
        status("preparing", "going"), status("preparing", "done", "at home"), status("idle", "done", "at home")
    )
    assert step(agent) == "homed: at home"
    assert agent.asked == [PrepareCommand(step="home"), StatusCommand(), StatusCommand()]


@pytest.mark.parametrize(
    ("answers", "words"),
    [
        ([Answer(ok=False, error="the agent is running; nothing was started")], "is running"),
        ([status("preparing", "going"), status("idle", "failed", "no reference")], "no reference"),
        (
            [status("preparing", "going"), status("tripped", "failed", "led no more", trip="force 1600 N")],
            "force 1600 N",
        ),
        ([status("preparing", "going"), AgentStatus(state="idle")], "started anew"),
    ],
)
def test_a_step_that_fails_says_why(step, answers, words):
    with pytest.raises(RunError, match=words):
        step(Agent(*answers))


@pytest.mark.parametrize("before", [[], [status("preparing", "going")]])
def test_whoever_interrupts_the_command_stops_the_rod(step, before):
    agent = Agent(*before, KeyboardInterrupt(), Answer(ok=True))
    with pytest.raises(KeyboardInterrupt):
        step(agent)
    assert agent.asked[-1] == StopCommand()

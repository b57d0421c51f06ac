"""Setup steps on the agent: each is sent once, and only a result that belongs to it counts."""

from datetime import UTC, datetime

import pytest

from bench.agent_protocol import AgentStatus, PrepareCommand, SetupStatus
from bench.campaigns import StoredCampaign
from bench.campaigns.benches.agent_setup import AgentSetup
from bench.campaigns.engine import Observation, advance
from bench.errors import AgentUnreachableError, RunError
from tests.unit.bench.campaigns.simulated_bench import ID, start


class Connection:
    """Connection to an agent whose status the test chooses."""

    def __init__(self):
        self.status, self.refusal, self.answers = AgentStatus(state="idle"), "", True
        self.sent = []

    def send_command(self, command, timeout=5.0):
        if not self.answers:
            raise AgentUnreachableError("no rig agent replied")
        if isinstance(command, PrepareCommand):
            self.sent.append((command.step, command.position_m))
            if self.refusal:
                raise RunError(self.refusal)
        return self.status

    def show(self, step, outcome, message="", state="idle", trip=""):
        shown = SetupStatus(step=step, outcome=outcome, message=message)
        self.status = AgentStatus(state=state, trip=trip, step=shown)


@pytest.fixture
def agent():
    return Connection()


def make_campaign(phase="starting", **setup):
    state = advance(start([{"setup": setup or {"step": "home"}}]), Observation(), 1001.0, ID)
    state = state.model_copy(update={"active": state.active.model_copy(update={"phase": phase})})
    return StoredCampaign(ID, "agent", datetime.now(UTC), {}, state)


def test_a_step_is_sent_once_with_its_target_and_reported_until_it_ends(agent):
    setup, campaign = AgentSetup(agent), make_campaign(step="move", position_m=0.01)
    setup.start(campaign)
    setup.start(campaign)
    assert agent.sent == [("move", 0.01)]
    agent.show("move", "running", state="preparing")
    assert setup.report(campaign).kind == "running"
    # The agent accepts the next command only a moment after the step has ended.
    agent.show("move", "done", "at 10 mm", state="preparing")
    assert setup.report(campaign).kind == "running"
    agent.show("move", "done", "at 10 mm")
    assert (setup.report(campaign).kind, setup.report(campaign).reason) == ("ended", "at 10 mm")
    agent.answers = False
    assert setup.report(campaign) is None


@pytest.mark.parametrize(
    ("message", "trip", "ending"),
    [("no reference", "", ""), ("stopped on request: the rod is at 3 mm", "", "stopped"),
     ("the agent was shut down: at 3 mm", "", "stopped"), ("no setpoints", "force 1600 N", "tripped"),
     ("no setpoints", "aborted by a person", "aborted")],
)  # fmt: skip
def test_a_failure_has_its_reason_and_who_has_ended_it(agent, message, trip, ending):
    setup, campaign = AgentSetup(agent), make_campaign()
    setup.start(campaign)
    agent.show("home", "failed", message, trip=trip)
    found = setup.report(campaign)
    assert (found.kind, found.reason, found.ending) == ("refused", trip or message, ending)


def test_a_refusal_is_raised_and_a_failure_in_the_reply_is_reported(agent):
    setup, campaign = AgentSetup(agent), make_campaign()
    agent.refusal = "the agent is running"
    with pytest.raises(RunError, match="the agent is running"):
        setup.start(campaign)
    setup = AgentSetup(agent)
    agent.refusal = "stopped on request: at 3 mm"
    agent.show("home", "failed", agent.refusal)
    setup.start(campaign)
    assert setup.report(campaign).ending == "stopped"


@pytest.mark.parametrize(
    ("phase", "outcome", "kind"),
    [("starting", "running", "running"), ("starting", "done", "crashed"), ("starting", "failed", "crashed"),
     ("preparing", "running", "running"), ("preparing", "done", "ended"), ("preparing", "failed", "refused")],
)  # fmt: skip
def test_another_process_sends_nothing_and_accepts_a_result_only_of_a_step_that_was_in_progress(
    agent, phase, outcome, kind
):
    agent.show("home", outcome, "text")
    setup, campaign = AgentSetup(agent), make_campaign(phase)
    assert setup.take_over(campaign).kind == kind
    setup.start(campaign)
    assert not agent.sent


def test_a_restarted_agent_and_another_step_are_no_result(agent):
    setup, campaign = AgentSetup(agent), make_campaign("preparing")
    assert "was restarted" in setup.take_over(campaign).reason
    agent.show("tare", "done")
    assert "another setup step" in setup.report(campaign).reason


def test_nothing_is_sent_while_the_agent_is_silent_after_a_restart(agent):
    setup, campaign = AgentSetup(agent), make_campaign()
    agent.answers = False
    assert setup.take_over(campaign) is None
    setup.start(campaign)
    agent.answers = True
    assert setup.report(campaign).kind == "crashed"
    assert not agent.sent

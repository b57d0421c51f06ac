"""States of the agent without a wire: their transitions, and the limits in each."""

import threading
import tomllib
from types import SimpleNamespace

import pytest

from bench.agent.agent import Agent
from bench.agent_protocol import AgentEvent, LeaseCommand, PrepareCommand, RunCommand, Sender
from bench.config import BenchConfig
from bench.errors import InterlockError
from bench.safety.limits import Action
from drivers.errors import NotConnectedError, RefusedError
from tests.support.fake_rig import BENCH_TOML
from tests.support.methods import constant, method_document, sine
from tests.support.run_bench import NO_WAITING

TIMEOUT = 10.0
BENCH = BenchConfig.model_validate(tomllib.loads(BENCH_TOML))


@pytest.fixture
def messages():
    return []


@pytest.fixture
def agent(messages, monkeypatch):
    """Return an agent whose moves continue until they are stopped."""
    agent = Agent(BENCH, publish=messages.append, timing=NO_WAITING)
    actuator = agent._rig.actuator
    monkeypatch.setattr(actuator, "read", lambda channel: SimpleNamespace(value=0.0))
    monkeypatch.setattr(actuator, "reset", lambda: None)
    monkeypatch.setattr(agent._rig.amplifier, "reset", lambda: None)
    agent.moving = threading.Event()

    def move(target, stop_requested):
        agent.moving.set()
        assert stop_requested.wait(TIMEOUT)
        raise RefusedError("stopped")

    agent._setup._move = move
    yield agent
    agent.shut_down()


def start_move(agent):
    assert agent.prepare(PrepareCommand(step="move", position_m=0.01)).ok
    assert agent.moving.wait(TIMEOUT)


def latch_trip(agent):
    agent._interlocks.latch("force 1600 N")
    agent._stop_moving("force 1600 N", False)


def test_a_held_agent_starts_nothing_for_others_and_stops_for_all(agent):
    holder, other = Sender(actor="campaign:night"), Sender(actor="user:anna")
    assert agent.lease(LeaseCommand(description="campaign night", duration_s=15, sender=holder)).ok
    assert agent.get_status().lease.holder == "campaign:night"
    for refused in (
        agent.prepare(PrepareCommand(step="move", position_m=0.01, sender=other)),
        agent.run(RunCommand(method={}, sender=other)),
    ):
        assert refused.error.startswith("campaign night holds the bench; nothing was started")
    assert agent.prepare(PrepareCommand(step="move", position_m=0.01, sender=holder)).ok
    assert agent.moving.wait(TIMEOUT)
    assert agent.stop().ok
    ended = agent.lease(LeaseCommand(description="campaign night", duration_s=0, sender=holder))
    assert ended.status.lease is None


def test_exceeded_limit_stops_a_setup_move_as_it_stops_a_run(agent):
    start_move(agent)
    agent._supervisor.apply(Action.CONTROLLED_STOP, "force 812 N exceeds the limit of 800 N")
    agent._setup.wait(TIMEOUT)
    status = agent.get_status()
    assert status.state == "idle"
    assert status.step.message == "force 812 N exceeds the limit of 800 N: stopped"


def test_silent_instrument_stops_a_setup_move_but_is_an_alarm_at_rest(agent, messages):
    start_move(agent)
    agent._on_instrument_failed("lvdt", NotConnectedError("lvdt: gone"))
    agent._setup.wait(TIMEOUT)
    assert agent.get_status().step.message == "lvdt: gone: stopped"
    agent._on_instrument_failed("cell", NotConnectedError("cell: gone"))
    alarms = [event.text for event in messages if isinstance(event, AgentEvent) and event.kind == "alarm"]
    assert "cell: gone" in alarms
    assert agent.get_status().trip == ""


def test_force_is_expected_only_while_the_rod_moves(agent):
    now = agent._clock() + 10**9
    start_move(agent)
    assert [one.quantity for one in agent._interlocks.check((), now)] == ["force_age"]
    agent.stop()
    agent._setup.wait(TIMEOUT)
    assert agent._interlocks.check((), now + 10**10) == []


def test_second_command_is_refused_while_a_step_is_in_progress(agent):
    start_move(agent)
    for reply in (agent.prepare(PrepareCommand(step="tare")), agent.run(RunCommand(method={}))):
        assert not reply.ok
        assert "the agent is preparing; nothing was started" in reply.error


def test_trip_cannot_be_reset_before_the_tripped_step_has_ended(agent):
    start_move(agent)
    latch_trip(agent)
    reply = agent.reset()
    assert (reply.ok, "has not ended yet" in reply.error) == (False, True)
    agent._setup._stop_requested.set()
    agent._setup.wait(TIMEOUT)
    assert agent.get_status().state == "tripped"
    assert "remove the cause, then reset" in agent.prepare(PrepareCommand(step="tare")).error
    assert agent.reset().ok
    assert agent.get_status().state == "idle"


def test_abort_stops_both_outputs_and_latches_also_at_rest(agent, messages, monkeypatch):
    stopped = []
    for one in (agent._rig.actuator, agent._rig.amplifier):
        monkeypatch.setattr(one, "make_safe", lambda name=one.name: stopped.append(name) or "")
    reply = agent.abort()
    assert (reply.ok, reply.status.state, reply.status.trip) == (True, "tripped", "aborted by a person")
    agent._supervisor.wait_until_stopped()
    assert sorted(stopped) == ["coil", "drive"]
    refused = agent.run(RunCommand(method={}))
    assert "the agent is tripped (aborted by a person)" in refused.error
    commands = [one.text for one in messages if isinstance(one, AgentEvent) and one.kind == "command"]
    assert commands == ["abort"]
    assert agent.reset().ok


def test_pause_without_a_run_is_refused(agent):
    reply = agent.pause()
    assert (reply.ok, reply.error) == (False, "no run is in progress; nothing was paused")


def test_status_is_available_while_instruments_reset(agent, monkeypatch):
    requested, free = threading.Event(), threading.Event()

    def reset():
        requested.set()
        assert free.wait(TIMEOUT)

    monkeypatch.setattr(agent._rig.amplifier, "reset", reset)
    latch_trip(agent)
    resetting = threading.Thread(target=agent.reset)
    resetting.start()
    assert requested.wait(TIMEOUT)
    states = []
    asking = threading.Thread(target=lambda: states.append(agent.get_status().state))
    asking.start()
    asking.join(TIMEOUT / 10)
    free.set()
    resetting.join(TIMEOUT)
    asking.join(TIMEOUT)
    assert states == ["tripped"]


def test_run_that_cannot_be_prepared_leaves_the_agent_idle(agent):
    method = method_document(sine("a", 0.01, 2.0, constant(0.2)))
    reply = agent.run(RunCommand(method=method | {"drive_kind": "coil_a"}))
    assert (reply.ok, "drives by coil_a" in reply.error) == (False, True)
    assert agent.get_status().state == "idle"


def test_run_whose_execution_fails_is_reported_and_the_agent_idle_again(agent, messages, tmp_path):
    def execute(prepared):
        raise ZeroDivisionError("division by zero")

    agent._run_slot._execute = execute
    method = method_document(sine("a", 0.01, 2.0, constant(0.2)))
    assert agent.run(RunCommand(method=method, log=str(tmp_path / "a.mcap"))).ok
    assert agent.wait(TIMEOUT)
    status = agent.get_status()
    assert (status.state, status.run.outcome) == ("idle", "incomplete")
    assert "ZeroDivisionError" in status.run.reason
    events = [event.text for event in messages if isinstance(event, AgentEvent) and event.kind == "run_finished"]
    assert len(events) == 1
    assert status.run.reason in events[0]


class TestRunsInSuccession:
    """Runs whose sequencer is replaced; the fixture's limits apply again after each."""

    OUTSIDE_METHOD = 0.03
    """[m] Position beyond the limit of the method and within that of the fixture."""

    @staticmethod
    def start(agent, play, log):
        """Start a run whose sequencer calls a function with the supervision and the sequencer."""
        prepare = agent._executor.prepare

        def prepare_with_double(command):
            prepared = prepare(command)
            sequencer = prepared.run.sequencer
            sequencer.run = lambda programme: play(prepared.supervision, sequencer)
            return prepared

        agent._executor.prepare = prepare_with_double
        method = method_document(sine("a", 0.01, 2.0, constant(0.2)))
        reply = agent.run(RunCommand(method=method, log=str(log)))
        agent._executor.prepare = prepare
        assert reply.ok, reply.error

    def finish(self, agent):
        """Wait for the end of the run; return outcome and reason once the limits are those of the fixture."""
        assert agent.wait(TIMEOUT)
        agent._interlocks.permit(position=self.OUTSIDE_METHOD)
        with pytest.raises(InterlockError):
            agent._interlocks.permit(position=2 * self.OUTSIDE_METHOD)
        assert agent._interlocks.compute_force_age(agent._clock() + 10**9) == 0.0
        status = agent.get_status()
        assert status.state == "idle"
        return status.run.outcome, status.run.reason

    def test_failed_run_does_not_affect_the_next_one(self, agent, tmp_path):
        def fail(supervision, sequencer):
            supervision.on_arrived()
            raise ZeroDivisionError("division by zero")

        self.start(agent, fail, tmp_path / "a.mcap")
        outcome, reason = self.finish(agent)
        assert (outcome, "ZeroDivisionError" in reason) == ("incomplete", True)
        self.start(agent, lambda supervision, sequencer: supervision.on_arrived(), tmp_path / "b.mcap")
        assert self.finish(agent) == ("clean", "")

    def test_stop_ends_the_run_that_has_narrower_limits(self, agent, tmp_path):
        arrived = threading.Event()

        def wait_for_stop(supervision, sequencer):
            supervision.on_arrived()
            arrived.set()
            assert sequencer._stop_requested.wait(TIMEOUT)

        self.start(agent, wait_for_stop, tmp_path / "a.mcap")
        assert arrived.wait(TIMEOUT)
        with pytest.raises(InterlockError):
            agent._interlocks.permit(position=self.OUTSIDE_METHOD)
        assert agent.stop().status.state == "stopping"
        assert self.finish(agent) == ("incomplete", "stopped on request")


def test_missing_priority_of_all_threads_is_one_warning(agent):
    agent._priority_warning = "no real-time priority 20: operation not permitted"
    first, second, *_ = agent._acquisition._threads
    first.warning, second.warning = agent._priority_warning, "no memory"
    assert [warning.split(";")[0] for warning in agent.get_status().warnings] == [
        "no memory",
        agent._priority_warning,
    ]

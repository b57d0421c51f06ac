"""The agent's states without a wire: what leads out of each, and what is watched in it."""

import threading
import tomllib
from types import SimpleNamespace

import pytest

from bench.agent.agent import Agent
from bench.agent.messages import AgentEvent, PrepareCommand
from bench.agent.runs import Runs
from bench.rig.config import BenchConfig
from bench.safety.limits import Action
from drivers.errors import NotConnected, Refused

WITHIN = 10.0
BENCH = BenchConfig.model_validate(
    tomllib.loads("""
[instruments]
drive = { driver = "actuator", interface = "socketcan" }
cell = { driver = "load_cell", url = "/dev/ttyUSB0" }
lvdt = { driver = "lvdt", url = "tcp://10.0.0.6" }
coil = { driver = "coil_amplifier", url = "tcp://10.0.0.7" }
""")
)


@pytest.fixture
def told():
    return []


@pytest.fixture
def agent(told, monkeypatch):
    """An agent whose rod is led nowhere: a move goes on until it is ended."""
    agent = Agent(BENCH, publish=told.append)
    rod = agent._rig.actuator
    monkeypatch.setattr(rod, "read", lambda channel: SimpleNamespace(value=0.0))
    monkeypatch.setattr(rod, "reset", lambda: None)
    monkeypatch.setattr(agent._rig.amplifier, "reset", lambda: None)
    agent.moving = threading.Event()

    def move(target, ending):
        agent.moving.set()
        assert ending.wait(WITHIN)
        raise Refused("broken off")

    agent._preparation._move = move
    monkeypatch.setattr("bench.agent.preparation._ANSWERED_WITHIN", 0.05)
    yield agent
    agent.shut_down()


def begin_to_move(agent):
    assert agent.prepare(PrepareCommand(step="move", position_m=0.01)).ok
    assert agent.moving.wait(WITHIN)


def test_a_limit_that_asks_for_a_stop_ends_a_move_as_it_ends_a_run(agent):
    begin_to_move(agent)
    agent._warden.act(Action.CONTROLLED_STOP, "force 812 N exceeds the limit of 800 N")
    agent._preparation.wait(WITHIN)
    status = agent.status()
    assert status.state == "idle"
    assert status.step.words == "force 812 N exceeds the limit of 800 N: broken off"


def test_while_the_rod_moves_an_instrument_that_falls_silent_is_no_mere_alarm(agent, told):
    begin_to_move(agent)
    agent._instrument_failed("lvdt", NotConnected("lvdt: gone"))
    agent._preparation.wait(WITHIN)
    assert agent.status().step.words == "lvdt: gone: broken off"
    agent._instrument_failed("cell", NotConnected("cell: gone"))
    alarms = [event.text for event in told if isinstance(event, AgentEvent) and event.kind == "alarm"]
    assert "cell: gone" in alarms
    assert agent.status().trip == ""


def test_force_is_expected_while_the_rod_moves_and_no_longer(agent):
    now = agent._clock() + 10**9
    begin_to_move(agent)
    assert [one.quantity for one in agent._interlocks.check((), now)] == ["force_age"]
    agent.stop()
    agent._preparation.wait(WITHIN)
    assert agent._interlocks.check((), now + 10**10) == []


def test_a_trip_is_not_taken_back_before_the_step_that_it_ended_is_over(agent):
    begin_to_move(agent)
    agent._interlocks.latch("force 1600 N")
    agent._stop_moving("force 1600 N", False)
    refused = agent.reset()
    assert (refused.ok, "has not ended yet" in refused.error) == (False, True)
    agent._preparation._ending.set()
    agent._preparation.wait(WITHIN)
    assert agent.status().state == "tripped"
    assert agent.reset().ok
    assert agent.status().state == "idle"


def test_a_status_comes_while_the_instruments_take_their_time_over_a_reset(agent, monkeypatch):
    asked, free = threading.Event(), threading.Event()

    def reset():
        asked.set()
        assert free.wait(WITHIN)

    monkeypatch.setattr(agent._rig.amplifier, "reset", reset)
    agent._interlocks.latch("force 1600 N")
    agent._stop_moving("force 1600 N", False)
    resetting = threading.Thread(target=agent.reset)
    resetting.start()
    assert asked.wait(WITHIN)
    seen = []
    asking = threading.Thread(target=lambda: seen.append(agent.status().state))
    asking.start()
    asking.join(WITHIN / 10)
    free.set()
    resetting.join(WITHIN)
    asking.join(WITHIN)
    assert seen == ["tripped"]


def test_what_threads_are_refused_is_said_once(agent):
    agent._no_priority = "no real-time priority 20: operation not permitted"
    agent._acquisition.warn("cell", agent._no_priority)
    agent._acquisition.warn("lvdt", "no memory")
    assert [sentence.split(";")[0] for sentence in agent.status().warnings] == ["no memory", agent._no_priority]


def test_a_run_that_ended_stands_among_the_finished_before_it_is_told():
    told, lock = [], threading.RLock()
    runs = Runs(lock, lambda run, facts: None, lambda status: told.append((status, runs.current, runs.finished)))
    assert runs.wait(0)
    assert runs.status() is None
    runs.begin(SimpleNamespace(status=lambda: "clean", log=None), None)
    assert runs.wait(WITHIN)
    assert told == [("clean", None, ("clean",))]
    assert runs.status() == "clean"


def test_how_far_a_run_is_is_asked_without_the_lock():
    """What a run asks may itself be waiting for it: then nothing would ever move again."""
    lock, free, ended = threading.RLock(), [], threading.Event()

    def try_it():
        free.append(lock.acquire(timeout=0.2))
        if free[-1]:
            lock.release()

    def status():
        other = threading.Thread(target=try_it)
        other.start()
        other.join()
        return "going"

    runs = Runs(lock, lambda run, facts: ended.wait(WITHIN), lambda status: None)
    runs.begin(SimpleNamespace(status=status, log=None), None)
    assert runs.status() == "going"
    assert free == [True]
    ended.set()
    assert runs.wait(WITHIN)

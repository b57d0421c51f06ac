"""What a technician does before a run, on the wires of the simulated rig."""

import subprocess

import pytest

from bench.agent_protocol.link import AgentClient
from bench.agent_protocol.messages import PrepareCommand, RunCommand, StatusCommand, StopCommand
from bench.config import load_config
from bench.errors import AgentUnreachableError
from tests.support.live_bench import COMMAND, DEADLINE, ended, live_bench, method, until

pytestmark = [pytest.mark.wire, pytest.mark.timeout(240)]


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bench")
    with (
        live_bench(folder) as bench,
        ended(
            subprocess.Popen(
                [COMMAND, "rig", "--config", bench.toml], stdout=subprocess.PIPE, stderr=subprocess.PIPE
            )
        ),
    ):
        until(lambda: answers(bench))
        yield bench


def client(bench):
    agent = load_config(bench.toml).agent
    return AgentClient(agent.commands, agent.samples)


def answers(bench):
    try:
        return client(bench).send(StatusCommand()).ok
    except AgentUnreachableError:
        return False


def status(bench):
    return client(bench).send(StatusCommand()).status


def prepare(bench, step, *more):
    """Exit status of ``mrbench prepare``, and what it said."""
    done = subprocess.run(
        [COMMAND, "prepare", step, *more, "--config", bench.toml], capture_output=True, text=True, timeout=DEADLINE
    )
    return done.returncode, (done.stdout + done.stderr).strip()


def test_homing_is_refused_with_a_specimen_clamped(bench):
    code, said = prepare(bench, "home")
    assert code == 1
    assert "a specimen is clamped" in said
    assert len(said.splitlines()) == 1


def test_taring_makes_the_present_force_zero_and_can_be_taken_back(bench):
    code, said = prepare(bench, "tare")
    assert (code, "are taken off the force" in said) == (0, True), said
    code, said = prepare(bench, "clear-tare")
    assert (code, "nothing is taken off" in said) == (0, True), said


def test_the_way_from_an_empty_rig_to_a_centred_specimen(bench):
    steps = (("unmount",), ("home",), ("mount",), ("move", "--to", "0.01"), ("centre",))
    said = [prepare(bench, *step) for step in steps]
    assert [code for code, _ in said] == [0] * 5, said
    assert [words.split(":")[0] for _, words in said] == ["homed", "homed", "mounted", "mounted", "centred"]
    assert "10.0" in said[3][1]
    assert bench.truth().position[-1] == pytest.approx(0.01, abs=1e-4)
    assert status(bench).reference_state == "centred"


def test_a_move_out_of_the_limits_is_refused_before_anything_moves(bench):
    before = bench.truth().position[-1]
    code, said = prepare(bench, "move", "--to", "0.2")
    assert (code, "200 mm exceeds the limit of 55 mm" in said, len(said.splitlines())) == (1, True, 1), said
    assert bench.truth().position[-1] == pytest.approx(before, abs=1e-5)


def test_a_stop_breaks_homing_off_and_the_rod_rests(bench):
    assert prepare(bench, "unmount")[0] == 0
    agent = client(bench)
    begun = agent.send(PrepareCommand(step="home"), DEADLINE)
    assert begun.status.state == "preparing", begun
    refused = agent.send(RunCommand(method=method()))
    assert (refused.ok, "the agent is preparing" in refused.error) == (False, True)
    agent.send(StopCommand())
    until(lambda: status(bench).state == "idle")
    until(lambda: status(bench).step.outcome == "failed")
    assert "interrupted" in status(bench).step.message
    until(bench.rests)


def test_an_unknown_step_is_misuse_and_answered_with_those_that_exist(bench):
    code, said = prepare(bench, "lubricate")
    assert code == 2
    assert "home, move, mount, centre, unmount, tare, clear-tare" in said


def test_nobody_else_has_the_wires_meanwhile(bench):
    """The coil's and the drive's would let a second agent in, and be brought to rest by it."""
    done = subprocess.run(
        [COMMAND, "run", bench.write_method(), "--config", bench.toml, "--out", bench.log],
        capture_output=True,
        text=True,
        timeout=DEADLINE,
    )
    assert (done.returncode, len(done.stderr.strip().splitlines())) == (1, 1)
    assert "another rig agent has this bench; end it" in done.stderr
    assert not bench.log.exists()

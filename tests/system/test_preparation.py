"""Setup steps before a run, on the wires of the simulated rig."""

import re
import subprocess

import pytest

from bench.agent_protocol import PrepareCommand, RunCommand, StatusCommand, StopCommand
from bench.agent_protocol.agent_client import AgentClient
from bench.agent_protocol.endpoint import find_agent
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
        until(lambda: is_answering(bench))
        yield bench


def client(bench):
    return AgentClient(*find_agent(bench.toml))


def is_answering(bench):
    try:
        return client(bench).send(StatusCommand()).ok
    except AgentUnreachableError:
        return False


def status(bench):
    return client(bench).send(StatusCommand()).status


def prepare(bench, step, *more):
    """Return the exit status of ``mrbench prepare`` and its output."""
    done = subprocess.run(
        [COMMAND, "prepare", step, *more, "--config", bench.toml], capture_output=True, text=True, timeout=DEADLINE
    )
    return done.returncode, (done.stdout + done.stderr).strip()


def test_homing_is_refused_while_a_specimen_is_clamped(bench):
    code, output = prepare(bench, "home")
    assert code == 1
    assert "a specimen is clamped" in output
    assert len(output.splitlines()) == 1


def test_taring_makes_the_present_force_zero_and_can_be_cleared(bench):
    code, output = prepare(bench, "tare")
    assert (code, "are subtracted from the force" in output) == (0, True), output
    code, output = prepare(bench, "clear-tare")
    assert (code, "nothing is subtracted" in output) == (0, True), output


def test_setup_from_an_empty_rig_to_a_centred_specimen(bench):
    steps = (("unmount",), ("home",), ("mount",), ("move", "--to", "0.01"), ("centre",))
    results = [prepare(bench, *step) for step in steps]
    assert [code for code, _ in results] == [0] * 5, results
    assert [words.split(":")[0] for _, words in results] == ["homed", "homed", "mounted", "mounted", "centred"]
    shown = re.search(r"the rod is at ([\d.]+) mm", results[3][1])
    assert shown is not None, results[3]
    assert float(shown[1]) == pytest.approx(10.0, abs=0.05)
    assert bench.truth().position[-1] == pytest.approx(0.01, abs=1e-4)
    assert status(bench).reference_state == "centred"


def test_a_move_beyond_the_limits_is_refused_before_any_motion(bench):
    before = bench.truth().position[-1]
    code, output = prepare(bench, "move", "--to", "0.2")
    assert (code, "200 mm exceeds the limit of 55 mm" in output, len(output.splitlines())) == (1, True, 1), output
    assert bench.truth().position[-1] == pytest.approx(before, abs=1e-5)


def test_a_stop_interrupts_homing_and_the_rod_comes_to_rest(bench):
    assert prepare(bench, "unmount")[0] == 0
    agent = client(bench)
    reply = agent.send(PrepareCommand(step="home"), DEADLINE)
    assert reply.status.state == "preparing", reply
    refused = agent.send(RunCommand(method=method()))
    assert (refused.ok, "the agent is preparing" in refused.error) == (False, True)
    agent.send(StopCommand())
    until(lambda: status(bench).state == "idle")
    until(lambda: status(bench).step.outcome == "failed")
    assert "interrupted" in status(bench).step.message
    until(bench.rests)


def test_an_unknown_step_is_misuse_and_the_message_lists_the_steps(bench):
    code, output = prepare(bench, "lubricate")
    assert code == 2
    assert "home, move, mount, centre, unmount, tare, clear-tare" in output


def test_a_second_agent_is_refused(bench):
    """The wires of coil and drive would accept a second agent, which would bring them to rest."""
    done = subprocess.run(
        [COMMAND, "run", bench.write_method(), "--config", bench.toml, "--out", bench.log],
        capture_output=True,
        text=True,
        timeout=DEADLINE,
    )
    assert (done.returncode, len(done.stderr.strip().splitlines())) == (1, 1)
    assert "another rig agent has this bench; end it" in done.stderr
    assert not bench.log.exists()

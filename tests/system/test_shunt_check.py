"""Shunt check on the wires of the simulated rig: a gain error of the load cell is in the record of the check."""

import numpy as np
import pytest

from bench.agent_protocol import RunCommand, StopCommand
from bench.checks import compute_records
from bench.log.reader import read_log
from tests.support.live_bench import (
    constant,
    fetch_status,
    live_bench,
    make_force_scenario,
    method,
    record_check,
    served_agent,
    until,
    until_ended,
    until_segment,
)

pytestmark = [pytest.mark.wire, pytest.mark.timeout(240)]
SHUNT = 1000.0
"""[N] Force that the shunt of the default scenario simulates."""
SEGMENTS = [
    {"name": name, "motion": {"kind": "hold"}, "duration_s": 3.0, "drive": constant(0.0), **more}
    for name, more in (("rest", {}), ("shunt", {"shunt": True}), ("rest_after", {}))
]
"""Segments of the shipped method, in a shorter time."""
LONG_SHUNT = [SEGMENTS[0], {**SEGMENTS[1], "duration_s": 40.0}, SEGMENTS[2]]


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("checks")
    return [
        record_check(folder / str(error), make_force_scenario(gain_error=error), "shunt_check", SEGMENTS)
        for error in (0.0, 0.01)
    ]


def test_a_gain_error_of_the_load_cell_is_the_same_part_of_the_shunt(logs):
    (before,), (after,) = map(compute_records, logs)
    assert (before.check, before.channel, before.instrument) == ("shunt", "force", "load_cell")
    # Each value is known to 0.07 N: noise of 2.5 N in two seconds, correlated by the filter of 300 Hz.
    assert before.value == pytest.approx(SHUNT, abs=0.5)
    assert after.value - before.value == pytest.approx(0.01 * SHUNT, abs=0.5)
    assert before.standard_uncertainty < 0.2


def test_the_force_has_the_shunt_in_its_segment_only(logs):
    log = logs[0]
    force = {one.name: log.samples["force_raw"][one.start : one.stop] for one in log.segments}
    assert np.all(force["shunt"][200:-200] > SHUNT - 50)
    for name in ("rest", "rest_after"):
        assert np.all(np.abs(force[name][200:-200]) < 100)


def test_the_shunt_is_off_after_a_run_that_was_stopped(tmp_path):
    """Before the stop the load cell reports the shunt, after it neither its status nor its force contains it."""
    command = RunCommand(method=method(name="shunt_check", segments=LONG_SHUNT), log=str(tmp_path / "run.mcap"))

    def read_message(agent):
        return next(one.message for one in fetch_status(agent).instruments if one.name == "load_cell")

    with live_bench(tmp_path) as bench, served_agent(bench) as agent:
        until(lambda: fetch_status(agent).state == "idle")
        assert agent.send(command).ok
        until_segment(agent, "shunt")
        until(lambda: "the shunt is on" in read_message(agent))
        assert agent.send(StopCommand()).ok
        assert until_ended(agent).run.ending == "stopped"
        assert "the shunt is on" not in read_message(agent)
        until(lambda: abs(bench.served.rig.read_latest("force", 1, 2**62)[1][0]) < 100)
    assert compute_records(read_log(tmp_path / "run.mcap")) == []

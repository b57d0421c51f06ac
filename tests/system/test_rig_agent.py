"""Rig agent on the wires of the simulated rig: runs, stops, trips, and the kill of its process."""

import json
import signal
import subprocess
import threading
from datetime import UTC, datetime

import numpy as np
import pytest

from bench.agent_protocol import (
    AgentEvent,
    AgentStatus,
    PauseCommand,
    ResetCommand,
    RunCommand,
    StopCommand,
)
from bench.catalogue.run_plan import read_plan
from bench.live import LiveBatch
from bench.log.reader import read_log
from sim_rig.protocols.fault_proxy import WireFault
from tests.support.live_bench import (
    COMMAND,
    DEADLINE,
    ended,
    fetch_status,
    live_bench,
    method,
    served_agent,
    until,
    until_ended,
    until_segment,
)

pytestmark = [pytest.mark.wire, pytest.mark.timeout(240)]


@pytest.fixture
def bench(tmp_path):
    with live_bench(tmp_path) as bench:
        yield bench


def finished(process):
    """Return exit status and error output of a run."""
    _, output = process.communicate(timeout=DEADLINE)
    return process.returncode, output


def mrbench_stop(bench, *words):
    """Return exit status and output of ``mrbench stop``."""
    command = [COMMAND, "stop", *words, "--config", bench.toml]
    done = subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE, check=False)
    return done.returncode, (done.stdout + done.stderr).strip()


def find_correlation(recorded, command):
    """Return the highest correlation of a recording with its command, for a servo that follows late."""
    lags, count = range(250), len(command) - 250
    return max(np.corrcoef(recorded[lag : lag + count], command[:count])[0, 1] for lag in lags)


def list_event_texts(log, kind):
    return [event["text"] for event in log.events if event["kind"] == kind]


def test_run_is_recorded_as_commanded(bench):
    with ended(bench.run("--specimen", "D1")) as process:
        code, output = finished(process)
    assert code == 0, output
    log = read_log(bench.log)
    samples = log.samples
    assert log.outcome == "clean", log.metadata["outcome"]
    assert log.metadata["run"]["specimen"] == "D1"
    assert [segment.name for segment in log.segments] == ["a", "b"]
    assert [(segment.stop - segment.start) / 1000 for segment in log.segments] == pytest.approx(
        [1.5, 2.0], abs=0.01
    )
    assert list_event_texts(log, "checkpoint") == ["after segment a"]
    for name in ("displacement", "force", "coil_drive", "actuator_position", "coil_current", "temperature"):
        assert np.isfinite(samples[name]).mean() > 0.99, name
    segment, command = log.segments[1], samples["displacement_command"]
    inside = slice(segment.start, segment.stop)
    assert find_correlation(samples["displacement"][inside], command[inside]) > 0.97
    assert np.ptp(samples["displacement"][inside]) == pytest.approx(0.016, rel=0.1)
    assert np.median(samples["coil_drive"][inside]) == pytest.approx(0.4, abs=2e-3)
    assert {"method.json", "bench.toml", "instruments.json"} <= log.attachments.keys()
    channels = json.loads(log.metadata["channels"]["force"])
    assert channels["filter"] == {"kind": "butterworth", "order": 2, "cutoff_hz": 300.0}
    until(bench.rests)


def test_drive_and_motion_begin_together_at_the_segment_mark(bench):
    with ended(bench.run()) as process:
        code, output = finished(process)
    assert code == 0, output
    samples = read_log(bench.log).samples
    commanded = np.flatnonzero(np.diff(samples["coil_drive_command"]) > 0.1)
    measured = np.flatnonzero((samples["coil_drive"][1:] > 0.1) & (samples["coil_drive"][:-1] < 0.1))
    assert len(commanded) >= 1
    assert abs(int(commanded[0]) - int(measured[0])) < 20
    segment = samples["segment"]
    at_a = np.flatnonzero(segment == 0)
    assert samples["displacement_command"][at_a[0]] == pytest.approx(0.0, abs=2e-4)


def test_trip_is_latched_until_a_reset(tmp_path):
    """The damper force exceeds a limit of the fixture in the middle of a stroke."""
    with live_bench(tmp_path, limits="force = { trip = 150.0 }") as bench, served_agent(bench) as agent:
        reply = agent.send(RunCommand(method=method(), log=str(bench.log)))
        assert reply.ok, reply.error
        status = until_ended(agent)
        assert status.state == "tripped"
        assert "exceeds the limit of 150 N" in status.trip
        assert (status.run.outcome, status.run.reason) == ("incomplete", status.trip)
        until(bench.rests)
        refused = agent.send(RunCommand(method=method(), log=str(bench.log)))
        assert not refused.ok
        assert "then reset" in refused.error
        assert agent.send(ResetCommand()).ok
        assert fetch_status(agent).state == "idle"
    log = read_log(bench.log)
    assert log.outcome == "incomplete"
    assert len(list_event_texts(log, "trip")) == 1
    assert np.max(np.abs(log.samples["force"])) > 150.0


def test_stopped_run_can_be_resumed_after_its_checkpoint(bench):
    with served_agent(bench) as agent:
        assert agent.send(RunCommand(method=method(), log=str(bench.log))).ok
        until_segment(agent, "b")
        agent.send(StopCommand())
        status = until_ended(agent)
        assert (status.state, status.run.outcome, status.run.reason) == (
            "idle",
            "incomplete",
            "stopped on request",
        )
        until(bench.rests)
        stopped = read_log(bench.log)
        assert list_event_texts(stopped, "checkpoint") == ["after segment a"]
        assert not list_event_texts(stopped, "trip")
        samples = stopped.samples
        assert np.nanmax(np.abs(np.diff(samples["displacement_command"], 2))) * 1e6 <= 9.0
        again = RunCommand(method=method(), log=str(bench.log), resume_after="a", continues=status.run.id)
        assert agent.send(again).ok
        status = until_ended(agent)
        assert status.run.outcome == "clean", status.run
        assert len(status.finished) == 2
    log = read_log(bench.log)
    assert [segment.name for segment in log.segments] == ["b"]
    assert (log.metadata["run"]["continues"], log.metadata["run"]["resumed_after"]) == (again.continues, "a")


def test_pause_ends_a_run_at_rest_at_its_next_checkpoint(bench):
    with served_agent(bench) as agent:
        assert agent.send(RunCommand(method=method(), log=str(bench.log))).ok
        until_segment(agent, "a")
        assert agent.send(PauseCommand()).status.run.pause == "at checkpoint a"
        run = until_ended(agent).run
        assert (run.outcome, run.ending, run.reason) == ("incomplete", "stopped", "paused at checkpoint a")
        until(bench.rests)
    log = read_log(bench.log)
    assert [segment.name for segment in log.segments] == ["a"]
    assert list_event_texts(log, "checkpoint") == ["after segment a"]
    assert (read_plan(bench.log).checkpoint, read_plan(bench.log).method["name"]) == ("a", "short")


def test_ctrl_c_stops_a_run_softly(bench):
    with ended(bench.run()) as process:
        until(bench.strokes)
        process.send_signal(signal.SIGINT)
        code, output = finished(process)
    assert code == 1
    assert len(output.strip().splitlines()) == 1
    assert "stopped on request" in output
    assert read_log(bench.log).outcome == "incomplete"
    assert bench.rests()


def test_mrbench_stop_ends_a_run_of_the_command_line(bench):
    with ended(bench.run()) as process:
        until(bench.strokes)
        code, output = mrbench_stop(bench)
        assert (code, str(bench.log) in output) == (0, True), output
        code, output = finished(process)
    assert (code, "stopped on request" in output) == (1, True), output
    assert read_log(bench.log).outcome == "incomplete"
    assert bench.rests()


def test_mrbench_stop_abort_trips_a_run_of_an_agent(bench):
    with served_agent(bench) as agent:
        assert agent.send(RunCommand(method=method(), log=str(bench.log))).ok
        until_segment(agent, "b")
        code, output = mrbench_stop(bench, "--abort")
        status = fetch_status(agent)
        assert (code, output.startswith("tripped: ")) == (0, True), output
        assert (status.state, status.run.ending) == ("tripped", "aborted")
        until(bench.rests)
        assert agent.send(ResetCommand()).ok
        assert mrbench_stop(bench) == (0, "nothing was in progress; the rig agent is idle")


def test_killed_agent_leaves_all_at_rest_and_its_log_can_be_salvaged(bench):
    with ended(bench.run()) as process:
        until(bench.strokes)
        process.kill()
        killed = datetime.now(UTC)
        process.communicate(timeout=DEADLINE)
    until(bench.rests, 10.0)
    salvaged = subprocess.run([COMMAND, "salvage", bench.log], capture_output=True, text=True, timeout=DEADLINE)
    assert salvaged.returncode == 0, salvaged.stderr
    log = read_log(bench.log)
    zero = datetime.fromisoformat(log.metadata["run"]["utc_offset"])
    kept = (killed - zero).total_seconds() - log.samples["time_ns"][-1] * 1e-9
    assert kept <= 0.5


def test_silent_load_cell_trips_and_the_log_is_closed(tmp_path):
    cut = WireFault(kind="stuck", start=8.0, duration=100.0)
    with live_bench(tmp_path, faults={"load_cell": (cut,)}) as bench:
        cycles = [{**segment, "cycles": 40} for segment in method()["segments"]]
        with ended(bench.run(segments=cycles)) as process:
            code, output = finished(process)
        until(bench.rests)
    assert code == 1
    assert "force age" in output
    log = read_log(bench.log)
    assert log.outcome == "incomplete"
    assert "force age" in log.metadata["outcome"]["reason"]


def test_output_on_a_dead_wire_is_not_reported_as_at_rest(tmp_path):
    cut = WireFault(kind="stuck", start=8.0, duration=100.0)
    with live_bench(tmp_path, faults={"coil_amplifier": (cut,)}) as bench:
        cycles = [{**segment, "cycles": 40} for segment in method()["segments"]]
        with ended(bench.run(segments=cycles)) as process:
            code, output = finished(process)
        until(bench.rests)
    assert code == 1, output
    (report,) = [one for one in read_log(bench.log).events if one["text"].startswith("outputs after the trip")]
    assert report["kind"] == "alarm"
    assert list(report["confirmed_after_s"]) == ["actuator"]
    assert list(report["not_confirmed"]) == ["coil_amplifier"]
    assert "coil_amplifier: rest not confirmed" in report["text"]


def test_agent_publishes_samples_and_the_end_of_a_run(bench):
    with served_agent(bench) as agent:
        stopping = threading.Event()
        assert agent.send(RunCommand(method=method(), log=str(bench.log))).ok
        again = agent.send(RunCommand(method=method()))
        assert (again.ok, "nothing was started" in again.error) == (False, True)
        seen = []
        for message in agent.subscribe(stopping):
            seen.append(message)
            if isinstance(message, AgentEvent) and message.kind == "run_finished":
                stopping.set()
        live = [message for message in seen if isinstance(message, LiveBatch)]
        units = dict(channel for one in live for channel in one.channels)
        assert (units["force"], units["coil_drive"]) == ("N", "V")
        assert {"displacement", "displacement_command"} <= set(units)
        # A busy machine stretches the samples of single batches.
        assert np.median([round(1 / one.period_s) for one in live if one.count > 9]) == 1000
        assert "running" in {message.state for message in seen if isinstance(message, AgentStatus)}
        assert fetch_status(agent).run.outcome == "clean"
    assert bench.rests()


def test_method_with_another_drive_is_refused_in_one_line(bench):
    with ended(bench.run(drive_kind="coil_a")) as process:
        code, output = finished(process)
    assert (code, len(output.strip().splitlines())) == (1, 1)
    assert "drives by coil_a, this bench by coil_v" in output
    assert not bench.log.exists()

"""Whole runs on doubles of actuator and amplifier; setpoints are sent by their thread."""

import threading
import time

import numpy as np
import pytest

from bench.errors import RunError
from bench.sequencer.command_history import CommandHistory
from bench.sequencer.sequencer import OPERATION_TIMEOUTS, AmplifierTimeouts, Sequencer
from drivers.channel import Channel
from drivers.errors import OutOfRangeError, RefusedError
from drivers.modbus.step_table import TableState
from tests.support.fake_rig import FakeActuator, FakeAmplifier, FakeGuard, FakeLoadCell, FakeObserver
from tests.support.methods import constant, hold, programme, sine

TIMEOUT = 10.0
LIMITS = {"stroke_m": 0.01, "velocity_mps": 0.5, "acceleration_mps2": 30.0}


def stroke(cycles=1, drive=None):
    segment = sine("a", 0.002, 10.0, drive or constant(0.3), fade_s=0.05, cycles=cycles)
    return programme(segment, **LIMITS)


SHORT, LONG = stroke(), stroke(cycles=300)


class Bench:
    """A sequencer with doubles of everything around it."""

    def __init__(self, actuator=None, amplifier=None, amplifier_rate=0.0, timeouts=OPERATION_TIMEOUTS, cell=None):
        self.calls = []
        self.actuator = FakeActuator(self.calls, **(actuator or {}))
        self.amplifier = FakeAmplifier(self.calls, **(amplifier or {}))
        self.cell = FakeLoadCell(self.calls, **(cell or {}))
        self.guard, self.observer = FakeGuard(), FakeObserver(self.calls)
        self.sequencer = Sequencer(
            self.actuator,
            self.amplifier,
            self.guard,
            CommandHistory(),
            time.monotonic_ns,
            self.observer,
            lambda: amplifier_rate,
            timeouts,
            self.cell,
        )

    def while_moving(self, action):
        """Call an action in another thread once the rod moves."""
        thread = threading.Thread(target=lambda: self.actuator.moving.wait(TIMEOUT) and action())
        thread.start()
        return thread


def test_run_goes_from_the_first_move_to_rest_at_the_end():
    bench = Bench()
    bench.sequencer.run(SHORT)
    assert bench.calls[:4] == ["actuator armed", "arrived", "table uploaded", "table armed"]
    assert bench.calls[-2:] == ["coil safe", "actuator disabled"]
    assert bench.observer.active == [True, False]
    assert max(bench.actuator.positions) == pytest.approx(0.002, rel=0.05)
    assert abs(bench.actuator.positions[-1]) < 1e-5
    assert bench.sequencer.stop_reason == ""


def test_table_times_follow_the_amplifiers_clock():
    bench = Bench(amplifier_rate=1e-3)
    bench.sequencer.run(stroke(drive={"kind": "steps", "time_s": [0, 0.04], "values": [0.1, 0.4]}))
    times, levels = bench.amplifier.uploaded
    assert levels.tolist() == [0.1, 0.4]
    assert times[1] == pytest.approx((0.05 + 0.04) * 1.001)


def test_stop_ends_the_motion_softly_and_is_not_an_error():
    bench = Bench()
    stopping = bench.while_moving(lambda: bench.sequencer.stop("enough"))
    bench.sequencer.run(LONG)
    stopping.join()
    assert bench.sequencer.stop_reason == "enough"
    assert bench.calls[-2:] == ["coil safe", "actuator disabled"]
    steps = np.abs(np.diff(bench.actuator.positions))
    assert steps[-1] < 1e-5
    intervals = np.diff(bench.actuator.due_ns) * 1e-9  # longer where the machine was late
    assert np.all(steps <= 0.126 * intervals * 1.05)


def test_paused_run_ends_at_rest_at_its_next_checkpoint():
    bench = Bench()
    segments = (sine(name, 0.002, 10.0, constant(0.2), fade_s=0.05, cycles=30) for name in ("a", "b"))
    two = programme(*segments, **LIMITS)
    pausing = bench.while_moving(bench.sequencer.pause)
    bench.sequencer.run(two)
    pausing.join()
    assert (bench.sequencer.paused_after, bench.sequencer.stop_reason) == ("a", "")
    assert bench.calls.count("table uploaded") == 1
    assert bench.calls[-2:] == ["coil safe", "actuator disabled"]
    assert abs(bench.actuator.positions[-1]) < 1e-5


def test_pause_after_the_last_checkpoint_lets_the_run_end():
    bench = Bench()
    bench.sequencer.pause()
    bench.sequencer.run(SHORT)
    assert bench.sequencer.paused_after == ""
    assert max(bench.actuator.positions) == pytest.approx(0.002, rel=0.05)


def test_first_reason_of_a_stop_is_kept():
    bench = Bench()

    def stop_twice():
        bench.sequencer.stop("first")
        bench.sequencer.stop("second")

    stopping = bench.while_moving(stop_twice)
    bench.sequencer.run(LONG)
    stopping.join()
    assert bench.sequencer.stop_reason == "first"


def test_run_that_is_stopped_before_its_begin_switches_nothing_on():
    bench = Bench()
    bench.sequencer.stop("stopped on request")
    bench.sequencer.run(LONG)
    assert bench.calls == []
    assert bench.observer.active == []
    assert bench.sequencer.stop_reason == "stopped on request"


def test_hold_continues_setpoints_until_a_stop():
    bench = Bench()
    holding = bench.while_moving(lambda: bench.sequencer.stop("held", hold=True))
    running = threading.Thread(target=bench.sequencer.run, args=(LONG,))
    running.start()
    holding.join()
    deadline = time.monotonic() + TIMEOUT
    while "the rod is held at its position; stop ends the hold" not in bench.observer.states:
        assert time.monotonic() < deadline
        time.sleep(0.001)
    sent = len(bench.actuator.positions)
    while len(bench.actuator.positions) < sent + 3:
        assert time.monotonic() < deadline, "no setpoints during the hold"
        time.sleep(0.001)
    assert "actuator disabled" not in bench.calls
    bench.sequencer.stop("released")
    running.join(TIMEOUT)
    assert bench.calls[-1] == "actuator disabled"
    assert bench.sequencer.stop_reason == "held"


def test_table_that_does_not_start_ends_the_run():
    bench = Bench(amplifier={"state": TableState.ARMED}, timeouts=AmplifierTimeouts(table_start=0.02))
    with pytest.raises(RunError, match=r"waited 0.02 s for its table to start with the SYNC; it is armed; check"):
        bench.sequencer.run(LONG)
    assert bench.calls[-2:] == ["coil safe", "actuator disabled"]


def test_slow_amplifier_is_armed_again_and_then_given_up():
    bench = Bench(actuator={"setpoint_timeout": 0.02}, amplifier={"arming_time": 0.03})
    with pytest.raises(RunError, match=r"armed 3 times, but each reply took longer than 12 ms; check its wire"):
        bench.sequencer.run(SHORT)
    assert bench.calls.count("table aborted") == 3
    assert max(np.abs(bench.actuator.positions)) < 1e-6


def test_refusing_drive_is_reported_at_once_and_stopped_by_its_own_ramp():
    bench = Bench(actuator={"refuses_at": 40})
    with pytest.raises(RefusedError, match="stopped by itself"):
        bench.sequencer.run(LONG)
    assert bench.observer.failures == ["actuator: the drive has stopped by itself"]
    assert bench.calls[-2:] == ["coil safe", "actuator safe"]
    assert bench.observer.active == [True, False]


def test_after_a_trip_the_sequencer_leaves_the_stop_to_the_supervisor():
    bench = Bench()

    def trip():
        bench.guard.trip_reason = "force 1600 N"

    tripping = bench.while_moving(trip)
    bench.sequencer.run(LONG)
    tripping.join()
    assert "force 1600 N" in bench.sequencer.stop_reason
    assert not {"coil safe", "actuator disabled", "actuator safe"} & set(bench.calls)


def test_coil_that_stays_on_is_reported():
    bench = Bench(amplifier={"output": 0.4}, timeouts=AmplifierTimeouts(zero_output=0.02))
    with pytest.raises(RunError, match=r"waited 0.02 s for its output to reach zero; it is 0.4; if its watchdog"):
        bench.sequencer.run(SHORT)


def test_forbidden_programme_is_refused_before_anything_moves():
    bench = Bench()
    bench.actuator.channels = (Channel("actuator_position", "m", -0.001, 0.001, "read_write", "rod"),)
    with pytest.raises(OutOfRangeError, match=r"outside -0\.001 to 0\.001 m"):
        bench.sequencer.run(SHORT)
    bench.actuator.channels = FakeActuator().channels
    bench.actuator.settings.max_speed = 0.1
    with pytest.raises(RunError, match=r"moves at 0.1\d+ m/s, but the actuator's limit is 0.1 m/s; lower"):
        bench.sequencer.run(SHORT)
    assert bench.calls == []


SHUNTED = programme(hold("a", 0.1), hold("b", 0.1, shunt=True), hold("c", 0.1), **LIMITS)
LONG_SHUNT = programme(hold("a", 0.1), hold("b", 30.0, shunt=True), hold("c", 0.1), **LIMITS)


def test_shunt_is_on_for_its_segment_only():
    bench = Bench()
    bench.sequencer.run(SHUNTED)
    played = [call for call in bench.calls if call.startswith(("shunt", "table armed"))]
    assert played == ["table armed", "shunt on", "table armed", "shunt off", "table armed"]
    assert bench.calls[-2:] == ["coil safe", "actuator disabled"]


def wait_for_shunt(bench):
    deadline = time.monotonic() + TIMEOUT
    while not bench.cell.is_on:
        assert time.monotonic() < deadline
        time.sleep(0.001)


@pytest.mark.parametrize("end", ["stop", "trip"])
def test_shunt_is_off_after_a_run_that_ends_early(end):
    bench = Bench()

    def end_run():
        wait_for_shunt(bench)
        if end == "stop":
            bench.sequencer.stop("enough")
        else:
            bench.guard.trip_reason = "force 1600 N"

    ending = threading.Thread(target=end_run)
    ending.start()
    bench.sequencer.run(LONG_SHUNT)
    ending.join()
    assert ("enough" if end == "stop" else "force 1600 N") in bench.sequencer.stop_reason
    assert bench.calls.count("shunt on") == bench.calls.count("shunt off") == 1
    assert not bench.cell.is_on
    assert bench.calls.count("table armed") == 2


def test_hold_after_a_stop_is_without_the_shunt():
    bench = Bench()

    def hold_and_release():
        wait_for_shunt(bench)
        bench.sequencer.stop("held", hold=True)
        deadline = time.monotonic() + TIMEOUT
        while "the rod is held at its position; stop ends the hold" not in bench.observer.states:
            assert time.monotonic() < deadline
            time.sleep(0.001)
        states.append(bench.cell.is_on)
        bench.sequencer.stop("released")

    states = []
    holding = threading.Thread(target=hold_and_release)
    holding.start()
    bench.sequencer.run(LONG_SHUNT)
    holding.join()
    assert states == [False]


def test_shunt_is_off_after_an_instrument_has_failed():
    bench = Bench(amplifier={"state": TableState.ARMED}, timeouts=AmplifierTimeouts(table_start=0.02))
    with pytest.raises(RunError, match="its table to start"):
        bench.sequencer.run(programme(hold("b", 0.1, shunt=True), **LIMITS))
    assert bench.calls[-4:] == ["shunt off", "coil safe", "coil safe", "actuator disabled"]


def test_load_cell_that_refuses_its_shunt_ends_the_run_at_rest():
    bench = Bench(cell={"refusal": RefusedError("cell: shunt refused")})
    with pytest.raises(RefusedError, match="shunt refused"):
        bench.sequencer.run(SHUNTED)
    assert bench.calls[-2:] == ["coil safe", "actuator disabled"]

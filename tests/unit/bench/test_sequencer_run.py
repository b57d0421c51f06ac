"""A whole run on an actuator and an amplifier that keep what they are told; setpoints leave on their thread."""

import itertools
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest

from bench.errors import Interlocked, RunError
from bench.methods import Method, compile_method
from bench.sequencer import move_rod as moving
from bench.sequencer import sequencer as sequencing
from bench.sequencer.move_rod import move_rod
from bench.sequencer.plan import RunPlan
from bench.sequencer.sequencer import Sequencer
from drivers.channel import Channel
from drivers.coil_table import TableProgress, TableState
from drivers.errors import NoReply, OutOfRange, Refused

WITHIN = 10.0
STROKE = {
    "schema": "mrbench.method/1",
    "name": "one_stroke",
    "title": "t",
    "description": "d",
    "rate_hz": 1000.0,
    "drive_kind": "coil_v",
    "limits": {"stroke_m": 0.01, "velocity_mps": 0.5, "acceleration_mps2": 30.0, "force_n": 900.0, "drive": 1.0},
    "segments": [
        {
            "name": "a",
            "motion": {"kind": "sine", "amplitude_m": 0.002, "frequency_hz": 10.0},
            "fade_s": 0.05,
            "cycles": 1,
            "drive": {"kind": "constant", "value": 0.3},
        }
    ],
}
SHORT = compile_method(Method.model_validate(STROKE))
LONG = compile_method(Method.model_validate({**STROKE, "segments": [{**STROKE["segments"][0], "cycles": 300}]}))


def monotonic_ns():
    return time.monotonic_ns()


class Rod:
    """An actuator on paper."""

    name = "actuator"

    def __init__(self, calls, stale_after=0.2, refuses_at=None):
        self.settings = SimpleNamespace(cycle=0.004, stale_after=stale_after, top_speed=1.0)
        self.channels = (Channel("actuator_position", "m", -0.01, 0.01, "read_write", "rod"),)
        self.sent, self.calls, self.refuses_at = [], calls, refuses_at
        self.reached = threading.Event()

    def arm(self):
        self.calls.append("rod armed")
        return 0.0

    def command(self, position, place_ns):
        if len(self.sent) == self.refuses_at:
            raise Refused("actuator: the drive has stopped by itself")
        self.sent.append(position)
        if len(self.sent) == 30:
            self.reached.set()

    def rest(self):
        self.calls.append("rod at rest")

    def make_safe(self):
        self.calls.append("rod safe")


class Coil:
    """A coil amplifier on paper."""

    name, table_capacity = "amplifier", 500

    def __init__(self, calls, state=TableState.RUNNING, output=0.0, slow=0.0):
        self.calls, self.state, self.output, self.slow, self.uploaded = calls, state, output, slow, None

    def upload(self, times, levels):
        self.calls.append("table up")
        self.uploaded = times, levels

    def arm(self):
        time.sleep(self.slow)
        self.calls.append("table armed")

    def abort_table(self):
        self.calls.append("table aborted")

    def table(self):
        return TableProgress(self.state, None)

    def make_safe(self):
        self.calls.append("coil safe")

    def condition(self):
        return SimpleNamespace(output=self.output)


class Guard:
    """Forbids nothing, until it is tripped."""

    tripped = ""

    def permit(self, position=None, drive=None):
        if self.tripped:
            raise Interlocked(self.tripped)


class Bench:
    """A sequencer with its surroundings, and what they were told."""

    def __init__(self, rod=None, coil=None, **more):
        self.calls, self.told, self.led, self.failed = [], [], [], []
        self.rod = Rod(self.calls, **(rod or {}))
        self.coil, self.guard, self.plan = Coil(self.calls, **(coil or {})), Guard(), RunPlan()
        self.sequencer = Sequencer(
            self.rod, self.coil, self.guard, self.plan, monotonic_ns, lambda *words: self.told.append(words),
            failed=self.failed.append, leading=self.led.append, arrived=lambda: self.calls.append("arrived"),
            **more,
        )  # fmt: skip

    def in_the_middle(self, act):
        """Do something from another thread once setpoints have left."""
        thread = threading.Thread(target=lambda: self.rod.reached.wait(WITHIN) and act())
        thread.start()
        return thread


def test_a_run_goes_from_the_first_move_to_the_rest_at_the_end():
    bench = Bench()
    bench.sequencer.run(SHORT)
    assert bench.calls[:4] == ["rod armed", "arrived", "table up", "table armed"]
    assert bench.calls[-2:] == ["coil safe", "rod at rest"]
    assert bench.led == [True, False]
    assert max(bench.rod.sent) == pytest.approx(0.002, rel=0.05)
    assert abs(bench.rod.sent[-1]) < 1e-5
    assert bench.sequencer.stopped == ""


def test_the_table_runs_by_the_amplifiers_own_clock():
    bench = Bench(clock_rate=lambda: 1e-3)
    steps = {"kind": "steps", "time_s": [0, 0.04], "values": [0.1, 0.4]}
    segment = {**STROKE["segments"][0], "drive": steps}
    programme = compile_method(Method.model_validate({**STROKE, "segments": [segment]}))
    bench.sequencer.run(programme)
    times, levels = bench.coil.uploaded
    assert levels.tolist() == [0.1, 0.4]
    assert times[1] == pytest.approx((0.05 + 0.04) * 1.001)


def test_a_stop_lets_the_motion_fade_out_and_is_no_error():
    bench = Bench()
    stopping = bench.in_the_middle(lambda: bench.sequencer.stop("enough"))
    bench.sequencer.run(LONG)
    stopping.join()
    assert bench.sequencer.stopped == "enough"
    assert bench.calls[-2:] == ["coil safe", "rod at rest"]
    steps = np.abs(np.diff(bench.rod.sent))
    assert steps[-1] < 1e-5
    assert steps.max() <= 0.126 * 0.004 * 1.05


def test_the_first_reason_to_stop_is_kept():
    bench = Bench()

    def twice():
        bench.sequencer.stop("first")
        bench.sequencer.stop("second")

    stopping = bench.in_the_middle(twice)
    bench.sequencer.run(LONG)
    stopping.join()
    assert bench.sequencer.stopped == "first"


def test_a_run_that_is_stopped_before_it_begins_switches_nothing_on():
    bench = Bench()
    bench.sequencer.stop("stopped on request")
    bench.sequencer.run(LONG)
    assert bench.calls == []
    assert bench.led == []
    assert bench.sequencer.stopped == "stopped on request"


def test_a_hold_keeps_the_rod_led_until_it_is_let_go():
    bench = Bench()
    holding = bench.in_the_middle(lambda: bench.sequencer.stop("held", hold=True))
    running = threading.Thread(target=bench.sequencer.run, args=(LONG,))
    running.start()
    holding.join()
    deadline = time.monotonic() + WITHIN
    while ("state", "the rod is held where it stands; stop ends it") not in bench.told:
        assert time.monotonic() < deadline
        time.sleep(0.001)
    sent = len(bench.rod.sent)
    while len(bench.rod.sent) < sent + 3:
        assert time.monotonic() < deadline, "nobody leads the rod"
        time.sleep(0.001)
    assert "rod at rest" not in bench.calls
    bench.sequencer.stop("let go")
    running.join(WITHIN)
    assert bench.calls[-1] == "rod at rest"
    assert bench.sequencer.stopped == "held"


def test_a_table_that_does_not_start_ends_the_run_in_words(monkeypatch):
    monkeypatch.setattr(sequencing, "_TABLE_WITHIN", 0.02)
    bench = Bench(coil={"state": TableState.ARMED})
    with pytest.raises(RunError, match=r"waited 0.02 s for its table to start with the SYNC; it is armed; see"):
        bench.sequencer.run(LONG)
    assert bench.calls[-2:] == ["coil safe", "rod at rest"]


def test_an_amplifier_that_answers_too_late_for_the_silence_is_tried_again_and_then_given_up():
    bench = Bench(rod={"stale_after": 0.02}, coil={"slow": 0.03})
    with pytest.raises(RunError, match=r"armed 3 times, each answer came later than 12 ms; see its wire"):
        bench.sequencer.run(SHORT)
    assert bench.calls.count("table aborted") == 3
    assert max(np.abs(bench.rod.sent)) < 1e-6


def test_a_drive_that_refuses_is_told_at_once_and_stopped_by_its_own_ramp():
    bench = Bench(rod={"refuses_at": 40})
    with pytest.raises(Refused, match="stopped by itself"):
        bench.sequencer.run(LONG)
    assert bench.failed == ["actuator: the drive has stopped by itself"]
    assert bench.calls[-2:] == ["coil safe", "rod safe"]
    assert bench.led == [True, False]


def test_after_a_trip_others_see_to_the_rest():
    bench = Bench()

    def trip():
        bench.guard.tripped = "force 1600 N"

    tripping = bench.in_the_middle(trip)
    bench.sequencer.run(LONG)
    tripping.join()
    assert "force 1600 N" in bench.sequencer.stopped
    assert not {"coil safe", "rod at rest", "rod safe"} & set(bench.calls)


def test_a_coil_that_stays_on_is_said(monkeypatch):
    monkeypatch.setattr(sequencing, "_ZERO_WITHIN", 0.02)
    bench = Bench(coil={"output": 0.4})
    with pytest.raises(RunError, match=r"waited 0.02 s for its output to come to zero; it is 0.4; its watchdog"):
        bench.sequencer.run(SHORT)


def test_what_will_be_forbidden_on_the_way_is_refused_before_anything_moves():
    bench = Bench()
    bench.rod.channels = (Channel("actuator_position", "m", -0.001, 0.001, "read_write", "rod"),)
    with pytest.raises(OutOfRange, match=r"lies outside -0\.001 to 0\.001 m"):
        bench.sequencer.run(SHORT)
    bench.rod.channels = (Channel("actuator_position", "m", -0.01, 0.01, "read_write", "rod"),)
    bench.rod.settings.top_speed = 0.1
    with pytest.raises(RunError, match=r"moves at 0.1\d+ m/s, the actuator is allowed 0.1 m/s; lower"):
        bench.sequencer.run(SHORT)
    assert bench.calls == []


class TestMove:
    """The rod led where no run does."""

    def lead(self, rod, target=0.0005, permit=lambda position: None, ending=None):
        led = []
        try:
            move_rod(rod, permit, monotonic_ns, led.append, target, ending or threading.Event())
        finally:
            self.led = led

    def test_it_arrives_softly_and_leaves_the_drive_without_voltage(self):
        rod = Rod(calls := [])
        self.lead(rod)
        assert rod.sent[-1] == pytest.approx(0.0005)
        assert all(after >= before for before, after in itertools.pairwise(rod.sent))
        assert calls == ["rod armed", "rod at rest"]
        assert self.led == [True, False]

    def test_a_forbidden_place_is_refused_before_anything_is_armed(self):
        def permit(position):
            raise Interlocked("outside")

        rod = Rod(calls := [])
        with pytest.raises(Interlocked, match="outside"):
            self.lead(rod, permit=permit)
        assert calls == []

    def test_broken_off_it_stands_on_the_way_and_says_so(self):
        ending, rod = threading.Event(), Rod([])
        breaking = threading.Thread(target=lambda: rod.reached.wait(WITHIN) and ending.set())
        breaking.start()
        with pytest.raises(RunError, match="broken off"):
            self.lead(rod, target=0.009, ending=ending)
        breaking.join()
        assert 0 < rod.sent[-1] < 0.009
        assert rod.calls[-1] == "rod at rest"

    def test_broken_off_before_it_begins_nothing_is_armed(self):
        (ending := threading.Event()).set()
        rod = Rod(calls := [])
        with pytest.raises(RunError, match="broken off before it began"):
            self.lead(rod, ending=ending)
        assert calls == []

    def test_a_drive_that_goes_is_made_safe_and_its_error_kept(self):
        rod = Rod(calls := [], refuses_at=3)
        with pytest.raises(Refused, match="stopped by itself"):
            self.lead(rod)
        assert calls == ["rod armed", "rod safe"]

    def test_a_rod_that_does_not_arrive_is_an_error(self, monkeypatch):
        monkeypatch.setattr(moving, "_SPARE", -1.0)
        rod = Rod(calls := [])
        with pytest.raises(RunError, match="has not arrived"):
            self.lead(rod, target=0.009)
        assert calls[-1] == "rod safe"

    def test_a_drive_that_cannot_be_armed_is_not_led(self):
        rod = Rod([])

        def arm():
            raise NoReply("actuator: silent")

        rod.arm = arm
        with pytest.raises(NoReply, match="silent"):
            self.lead(rod)
        assert rod.sent == []

"""Safety supervisor on doubles of rig and interlocks: following error, late setpoints, alarms and trips."""

from types import SimpleNamespace

import numpy as np
import pytest

from bench.agent.supervisor import SafetySupervisor
from bench.rig.acquisition import Batch
from bench.rig.clock_map import ClockMap
from bench.safety.interlocks import Interlocks, Trip
from bench.safety.limits import Action, LimitViolation
from drivers.channel import ClockReading, SampleBlock
from tests.support.fake_rig import EventLog, FakeActuator, FakeAmplifier

MS = 1_000_000
HISTORY = SimpleNamespace(find_position=lambda time_ns: time_ns * 1e-9)
"""Commands of a rod at 1 m/s."""


class RecordingInterlocks:
    """Interlocks that find no violation, and keep the values that they check."""

    def __init__(self):
        self.values = {}

    def check(self, blocks, now_ns):
        return []

    def check_value(self, quantity, value, now_ns):
        self.values[quantity] = value
        return []


@pytest.fixture
def events():
    return EventLog()


@pytest.fixture
def supervisor(events):
    return make_supervisor(RecordingInterlocks(), events)


def make_supervisor(interlocks, events, stops=None):
    rig = SimpleNamespace(actuator=FakeActuator(), amplifier=FakeAmplifier())
    stops = [] if stops is None else stops
    return SafetySupervisor(
        rig, interlocks, lambda: 0, {"actuator": ClockMap()}, events, lambda *stop: stops.append(stop)
    )


def late_batch(device_ms):
    """Return two samples of a rod exactly at its setpoint, read 50 ms after the second was taken."""
    device_ns = None if device_ms is None else np.array(device_ms) * MS
    values = np.array([0.100, 0.104])
    return Batch("actuator", (SampleBlock("actuator_position", 0, device_ns, 154 * MS, values, values, "good"),))


def test_setpoint_that_is_too_late_for_the_drive_is_an_event(supervisor, events):
    supervisor.on_late_setpoint(0, 0.0123)
    details = {"quantity": "setpoint_lateness", "value": 0.0123}
    assert events.events == [("late", "a setpoint left 12.3 ms late", details)]


def test_delay_that_the_drive_bridges_is_not_an_event(supervisor, events):
    supervisor.on_late_setpoint(0, 0.0079)
    assert events.events == []


def test_samples_that_are_read_late_have_no_following_error(supervisor):
    supervisor._maps["actuator"].add_reading(ClockReading(1000 * MS, 0, 0))
    with supervisor.follow(HISTORY):
        supervisor.on_samples(late_batch([1100, 1104]))
    assert supervisor._interlocks.values["following_error"] == pytest.approx(0, abs=1e-6)


def test_without_a_clock_the_time_of_receipt_counts(supervisor):
    with supervisor.follow(HISTORY):
        supervisor.on_samples(late_batch(None))
    assert supervisor._interlocks.values["following_error"] == pytest.approx(-0.05)


def test_following_error_is_checked_during_a_run_only(supervisor):
    with supervisor.follow(HISTORY):
        pass
    supervisor.on_samples(late_batch(None))
    assert supervisor._interlocks.values == {}


def test_lost_sample_does_not_displace_the_others(supervisor):
    """The second of three samples is lost, so the two others are two cycles apart."""
    blocks = [
        SampleBlock("actuator_position", number, None, 112 * MS, np.array([position]), np.array([0.0]), "good")
        for number, position in ((7, 0.104), (9, 0.112))
    ]
    with supervisor.follow(HISTORY):
        supervisor.on_samples(Batch("actuator", tuple(blocks)))
    assert supervisor._interlocks.values["following_error"] == pytest.approx(0, abs=1e-9)


def test_alarm_has_value_and_limit_as_details(supervisor, events):
    violation = LimitViolation("force", Action.INDICATE, 812.0, 800.0)
    supervisor._interlocks.check = lambda blocks, now_ns: [violation]
    supervisor.on_timer()
    details = {"quantity": "force", "value": 812.0, "limit": 800.0}
    assert events.events == [("alarm", "force 812 N exceeds the limit of 800 N", details)]


@pytest.mark.parametrize(
    ("action", "stops"),
    [
        (Action.NONE, []),
        (Action.INDICATE, []),
        (Action.HOLD, [("hot", True)]),
        (Action.CONTROLLED_STOP, [("hot", False)]),
    ],
)
def test_action_stops_the_run_as_it_demands(events, action, stops):
    stopped = []
    make_supervisor(Interlocks({}, "coil_voltage"), events, stopped).apply(action, "hot")
    assert stopped == stops


def test_trip_stops_coil_and_actuator_once(events):
    stops = []
    supervisor = make_supervisor(Interlocks({}, "coil_voltage"), events, stops)
    supervisor.trip("force 1600 N")
    supervisor.trip("another reason")
    assert supervisor.wait_until_stopped() == Trip("force 1600 N")
    assert supervisor._rig.actuator.calls == ["actuator safe"]
    assert supervisor._rig.amplifier.calls == ["coil safe"]
    assert events.list_texts("trip") == ["force 1600 N"]
    assert stops == [("force 1600 N", False)]


@pytest.mark.parametrize(
    ("unconfirmed", "kind", "text"),
    [
        ("", "state", "actuator: rest confirmed after"),
        ("Broken pipe", "alarm", "actuator: rest not confirmed: Broken pipe"),
    ],
)
def test_trip_reports_rest_only_for_what_a_driver_confirmed(events, unconfirmed, kind, text):
    supervisor = make_supervisor(Interlocks({}, "coil_voltage"), events)
    supervisor._rig.actuator.unconfirmed = unconfirmed
    supervisor.trip("the wire is gone")
    supervisor.wait_until_stopped()
    (report,) = [one for one in events.events if one[1].startswith("outputs after the trip")]
    assert report[0] == kind
    assert text in report[1]
    assert "amplifier: rest confirmed after" in report[1]
    assert report[2]["not_confirmed"] == ({"actuator": unconfirmed} if unconfirmed else {})


def test_abort_after_a_trip_does_not_take_its_place():
    supervisor = make_supervisor(Interlocks({}, "coil_voltage"), EventLog())
    supervisor.trip("force 1600 N")
    supervisor.trip("aborted by a person", by_person=True)
    assert supervisor.wait_until_stopped() == Trip("force 1600 N", by_person=False)


@pytest.mark.parametrize(("delay", "is_event"), [(0.008, False), (0.008_001, True)])
def test_two_cycles_of_four_milliseconds_are_bridged(supervisor, events, delay, is_event):
    supervisor.on_late_setpoint(0, delay)
    assert bool(events.events) is is_event
    assert supervisor._interlocks.values == {"setpoint_lateness": delay}


def test_following_error_is_that_of_the_actuator_only(supervisor):
    batch = late_batch(None)
    with supervisor.follow(HISTORY):
        supervisor.on_samples(batch._replace(instrument="lvdt"))
    assert supervisor._interlocks.values == {}


def test_largest_of_several_following_errors_counts():
    """The last of three samples was taken on receipt at 112 ms, the others one and two cycles before."""
    interlocks = RecordingInterlocks()
    supervisor = make_supervisor(interlocks, EventLog())
    values = np.array([0.104, 0.105, 0.112])
    with supervisor.follow(HISTORY):
        block = SampleBlock("actuator_position", 40, None, 112 * MS, values, values, "good")
        supervisor.on_samples(Batch("actuator", (block,)))
    assert interlocks.values["following_error"] == pytest.approx(-0.003, abs=1e-9)

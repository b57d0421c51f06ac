"""The actuator's driver and the simulated drive, over socketcand."""

import math
import time
from dataclasses import replace

import numpy as np
import pytest

from drivers.actuator.actuator import Actuator
from drivers.actuator.cia402 import FaultKind
from drivers.actuator.reference_state import ReferenceState
from drivers.actuator.servo_drive import ActuatorSettings
from drivers.errors import NoReplyError, OutOfRangeError, RefusedError
from drivers.transport.can_bus import CanAddress, pack_frame, unpack_frame
from sim_rig.instruments.cia402_states import DriveState
from sim_rig.instruments.encoder import DriveMechanics
from tests.support.can_rig import PATIENT, CanRig, SetpointThread, collect_positions, connected, sine, wait_until

pytestmark = pytest.mark.timeout(60)


@pytest.fixture
def rig():
    rig = CanRig(referenced=True)
    yield rig
    rig.close()


def test_the_rod_follows_setpoints_and_every_sync_gives_one_sample_with_its_time(rig):
    with connected(rig, clamped=True) as actuator, SetpointThread(actuator, sine) as sender:
        blocks = collect_positions(actuator, 250)
        assert sender.error is None
        numbers = np.concatenate([b.first + np.arange(len(b.values)) for b in blocks])
        values = np.concatenate([b.values for b in blocks])
        times = np.concatenate([b.device_ns for b in blocks])
        assert np.array_equal(numbers, np.arange(len(numbers)))
        assert np.all(np.diff(times) >= 0)
        assert abs(values.max() - 0.01) < 2e-3
        assert abs(values.min() + 0.01) < 2e-3
        assert {b.quality for b in blocks} == {"good"}
        assert actuator.get_health().lost == 0


def test_torque_is_the_force_on_the_rod_through_the_lead_of_the_screw(rig):
    with connected(rig) as actuator:
        assert actuator.read("actuator_torque").value == pytest.approx(120 * 5e-3 / (2 * math.pi), abs=1e-3)
        assert actuator.read("actuator_torque").raw == 75


def test_limits_are_in_the_drive_after_connecting(rig):
    settings = ActuatorSettings(
        travel=(-0.02, 0.03),
        torque_limit=0.635,
        following_error_window=2e-3,
        position_window=5e-5,
        setpoint_timeout=0.03,
    )
    with connected(rig, settings):
        objects = rig.drive.objects
        assert [objects.get_number(0x607D, sub) for sub in (1, 2)] == [-200_000, 300_000]
        assert objects.get_number(0x6072) == 500
        assert objects.get_number(0x6065) == 20_000
        assert objects.get_number(0x6067) == 500
        assert [objects.get_number(0x60C2, sub) for sub in (1, 2)] == [4, -3]
        assert objects.get_number(0x1400, 5) == 30


def test_a_limit_that_the_drive_changes_is_refused(rig):
    real = rig.drive.objects.download
    rig.drive.objects.download = lambda index, sub, data: None if index == 0x6072 else real(index, sub, data)
    with pytest.raises(RefusedError, match="6072h:00 was set to 945 but reads 1000"), connected(rig):
        pass


def test_a_limit_outside_the_drives_range_is_refused_with_the_abort_text(rig):
    settings = ActuatorSettings(torque_limit=5.0)
    with pytest.raises(RefusedError, match="Value of parameter written too high"), connected(rig, settings):
        pass


def test_setpoints_outside_the_travel_or_too_fast_are_not_sent(rig):
    with connected(rig, ActuatorSettings(max_speed=0.5)) as actuator:
        actuator.arm()
        frames = []
        actuator.add_listener(frames.append)
        with pytest.raises(OutOfRangeError, match=r"outside -0\.06 to 0\.06 m"):
            actuator.send_setpoint(0.07)
        with pytest.raises(OutOfRangeError, match="m/s are allowed"):
            actuator.send_setpoint(0.05)
        with pytest.raises(OutOfRangeError):
            actuator.send_setpoint(math.nan)
        assert [frame for frame in frames if frame.sent] == []


def test_setpoints_before_arming_are_refused(rig):
    with connected(rig) as actuator, pytest.raises(RefusedError, match="not armed"):
        actuator.send_setpoint(0.0)


def test_write_sends_a_setpoint_and_other_channels_cannot_be_written(rig):
    with connected(rig) as actuator:
        actuator.arm()
        actuator.write("actuator_position", 1e-4)
        wait_until(lambda: abs(rig.rod.position - 1e-4) < 1e-3)
        with pytest.raises(OutOfRangeError):
            actuator.write("actuator_torque", 0.0)
        with pytest.raises(OutOfRangeError, match="no channel colour"):
            actuator.read("colour")


def test_the_drive_of_a_killed_agent_comes_to_rest_by_itself(rig):
    settings = replace(PATIENT, setpoint_timeout=0.1)
    actuator = Actuator(
        "actuator", CanAddress("socketcand", port=rig.server.port), time.monotonic_ns, settings=settings
    )
    actuator.connect()
    with SetpointThread(actuator, sine):
        collect_positions(actuator, 30)
    actuator._bus.close()
    wait_until(lambda: rig.drive.state is DriveState.QUICK_STOP and rig.drive.generator.velocity == 0)
    assert rig.drive.objects.get_number(0x603F) == 0x8250
    position = rig.rod.position
    with connected(rig) as reconnected:
        assert reconnected._drive.read_state().value == "switch on disabled"
    assert rig.rod.position == position


def test_the_drive_stops_by_itself_if_only_the_heartbeat_is_lost(rig):
    settings = ActuatorSettings(
        setpoint_timeout=0.0, master_heartbeat_timeout=0.2, master_heartbeat_period=0.02, max_speed=5.0
    )
    with connected(rig, settings) as actuator:
        with SetpointThread(actuator, lambda t: 0.0):
            collect_positions(actuator, 20)
        wait_until(lambda: rig.drive.state is DriveState.QUICK_STOP)
        wait_until(lambda: actuator.faults)
        assert actuator.faults[0].kind is FaultKind.MASTER_LOST


def test_late_setpoints_bring_no_heartbeat(rig):
    with connected(rig) as actuator:
        actuator.arm()
        heartbeats = []
        actuator.add_listener(
            lambda frame: heartbeats.append(frame) if unpack_frame(frame.data)[0] == 0x77F else None
        )
        actuator._setpoints._last_ns -= int(0.02e9)
        actuator.send_setpoint(0.0)
        assert heartbeats == []


def test_a_stop_of_the_drive_is_reported_with_its_reason_and_needs_a_reset(rig):
    with connected(rig) as actuator:
        with SetpointThread(actuator, sine) as sender:
            collect_positions(actuator, 20)
            rig.drive.raise_fault(0x4310)
            wait_until(lambda: sender.error)
        assert isinstance(sender.error, RefusedError)
        assert "over-temperature (emergency 4310h)" in str(sender.error)
        assert actuator.get_health().message == "over-temperature (emergency 4310h)"
        with pytest.raises(RefusedError, match="find the cause, then reset"):
            actuator.arm()
        actuator.reset()
        assert actuator.faults == ()
        actuator.arm()


def test_a_rod_that_does_not_follow_is_a_fault(rig):
    rig.rod.stuck = True
    with connected(rig) as actuator, SetpointThread(actuator, lambda t: min(0.05 * t, 0.02)) as sender:
        wait_until(lambda: sender.error)
        assert actuator.faults[0].kind is FaultKind.FOLLOWING_ERROR


def test_beyond_the_torque_limit_the_rod_stays_behind_until_a_following_error(rig):
    with connected(rig) as actuator:
        rig.rod.force = 5000.0
        with SetpointThread(actuator, lambda t: min(0.05 * t, 0.02)) as sender:
            wait_until(lambda: sender.error)
        assert actuator.faults[0].kind is FaultKind.FOLLOWING_ERROR
        assert abs(rig.rod.position) < 1e-3


def test_made_safe_during_strokes_the_rod_is_at_rest(rig):
    with connected(rig) as actuator:
        with SetpointThread(actuator, sine):
            collect_positions(actuator, 20)
            assert actuator.make_safe() == ""
        assert rig.drive.state is DriveState.QUICK_STOP
        assert rig.drive.generator.velocity == 0
        assert actuator.get_health().message == ""


def test_disabling_causes_no_fault(rig):
    with connected(rig) as actuator:
        with SetpointThread(actuator, lambda t: 0.0):
            collect_positions(actuator, 20)
        actuator.disable()
        assert rig.drive.state is DriveState.SWITCH_ON_DISABLED
        assert actuator.faults == ()
        actuator.arm()


def test_replay_of_the_recorded_frames_gives_the_same_samples(rig):
    frames = []
    with connected(rig) as actuator:
        actuator.add_listener(frames.append)
        with SetpointThread(actuator, sine):
            live = np.concatenate([b.values for b in collect_positions(actuator, 100)])
        decoder = actuator._samples.make_decoder(actuator.origin, actuator.rated_torque)
    for frame in frames:
        decoder.add_frame(frame)
    replayed = np.concatenate([b.values for b in decoder.pop_blocks() if b.channel == "actuator_position"])
    assert np.array_equal(replayed[: len(live)], live)


def test_home_mount_centre_and_stroke():
    rig = CanRig(mechanics=DriveMechanics(limit_switch=-0.004))
    rig.drive.objects.set_value(0x607C, -40_000)
    with connected(rig) as actuator:
        assert actuator.reference_state is ReferenceState.UNREFERENCED
        with pytest.raises(RefusedError, match="home it first"):
            actuator.arm()
        actuator.home()
        assert actuator.reference_state is ReferenceState.HOMED
        assert actuator.read("actuator_position").value == pytest.approx(-0.004)
        actuator.mount()
        actuator.centre()
        assert actuator.read("actuator_position").value == pytest.approx(0.0)
        assert actuator.channels[0].low == pytest.approx(-0.056)
        with SetpointThread(actuator, lambda t: 0.002 * math.sin(2 * math.pi * t)):
            collect_positions(actuator, 50)
        actuator.disable()
        with pytest.raises(RefusedError, match="a specimen is clamped"):
            actuator.home()
        actuator.unmount()
        assert actuator.reference_state is ReferenceState.HOMED
    rig.close()


def test_homing_that_does_not_end_is_stopped_and_the_rod_is_at_rest():
    rig = CanRig(mechanics=DriveMechanics(limit_switch=-0.05))
    with connected(rig) as actuator:
        with pytest.raises(NoReplyError, match=r"waited 0\.1 s for the reference"):
            actuator.home(timeout=0.1)
        assert actuator.reference_state is ReferenceState.UNREFERENCED
        assert rig.drive.generator.velocity == 0
    rig.close()


def test_a_clamped_specimen_without_a_reference_is_reported():
    rig = CanRig()
    with connected(rig, clamped=True) as actuator:
        assert actuator.reference_state is ReferenceState.REFERENCE_LOST
        with pytest.raises(RefusedError, match="unclamp the specimen"):
            actuator.arm()
    rig.close()


def test_frames_are_packed_in_the_layout_of_linux():
    assert unpack_frame(pack_frame(0x205, b"\x01\x02")) == (0x205, b"\x01\x02")
    assert len(pack_frame(0x80, b"")) == 16

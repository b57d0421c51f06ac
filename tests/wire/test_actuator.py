"""The actuator's driver leads the simulated drive, over socketcand."""

import math
import time
from dataclasses import replace

import numpy as np
import pytest
from can_rig import PATIENT, CanRig, Leader, connected, positions, sine, wait_until

from drivers.actuator import Actuator
from drivers.can_bus import CanAddress, pack_frame, unpack_frame
from drivers.cia402 import FaultKind
from drivers.errors import NoReply, OutOfRange, Refused
from drivers.mounting import Mounting
from drivers.servo_drive import ActuatorSettings
from sim_rig.drive_senses import Machine
from sim_rig.drive_states import State

pytestmark = pytest.mark.timeout(60)


@pytest.fixture
def rig():
    rig = CanRig(referenced=True)
    yield rig
    rig.close()


def test_rod_follows_setpoints_and_every_sync_gives_one_stamped_sample(rig):
    with connected(rig, clamped=True) as actuator, Leader(actuator, sine) as leader:
        blocks = positions(actuator, 250)
        assert leader.error is None
        numbers = np.concatenate([b.first + np.arange(len(b.values)) for b in blocks])
        values = np.concatenate([b.values for b in blocks])
        stamps = np.concatenate([b.device_ns for b in blocks])
        assert np.array_equal(numbers, np.arange(len(numbers)))
        assert np.all(np.diff(stamps) >= 0)
        assert abs(values.max() - 0.01) < 2e-3
        assert abs(values.min() + 0.01) < 2e-3
        assert {b.quality for b in blocks} == {"good"}
        assert actuator.health().lost == 0


def test_torque_is_the_force_on_the_rod_through_its_lead(rig):
    with connected(rig) as actuator:
        assert actuator.read("actuator_torque").value == pytest.approx(120 * 5e-3 / (2 * math.pi), abs=1e-3)
        assert actuator.read("actuator_torque").raw == 75


def test_limits_stand_in_the_drive_after_connecting(rig):
    settings = ActuatorSettings(travel=(-0.02, 0.03), torque=0.635, following=2e-3, arrival=5e-5, stale_after=0.03)
    with connected(rig, settings):
        objects = rig.drive.objects
        assert [objects.number(0x607D, sub) for sub in (1, 2)] == [-200_000, 300_000]
        assert objects.number(0x6072) == 500
        assert objects.number(0x6065) == 20_000
        assert objects.number(0x6067) == 500
        assert [objects.number(0x60C2, sub) for sub in (1, 2)] == [4, -3]
        assert objects.number(0x1400, 5) == 30


def test_limit_that_the_drive_does_not_keep_is_refused(rig):
    real = rig.drive.objects.download
    rig.drive.objects.download = lambda index, sub, data: None if index == 0x6072 else real(index, sub, data)
    with pytest.raises(Refused, match="6072h:00 was set to 945 but reads 1000"), connected(rig):
        pass


def test_limit_outside_the_drives_range_is_refused_with_the_abort_text(rig):
    settings = ActuatorSettings(torque=5.0)
    with pytest.raises(Refused, match="Value of parameter written too high"), connected(rig, settings):
        pass


def test_setpoints_outside_the_travel_or_too_fast_are_not_sent(rig):
    with connected(rig, ActuatorSettings(top_speed=0.5)) as actuator:
        actuator.arm()
        frames = []
        actuator.listen(frames.append)
        with pytest.raises(OutOfRange, match=r"outside -0\.06 to 0\.06 m"):
            actuator.command(0.07)
        with pytest.raises(OutOfRange, match="m/s are allowed"):
            actuator.command(0.05)
        with pytest.raises(OutOfRange):
            actuator.command(math.nan)
        assert [frame for frame in frames if frame.sent] == []


def test_commands_before_arming_are_refused(rig):
    with connected(rig) as actuator, pytest.raises(Refused, match="not armed"):
        actuator.command(0.0)


def test_write_is_a_setpoint_and_other_channels_cannot_be_written(rig):
    with connected(rig) as actuator:
        actuator.arm()
        actuator.write("actuator_position", 1e-4)
        wait_until(lambda: abs(rig.rod.position - 1e-4) < 1e-3)
        with pytest.raises(OutOfRange):
            actuator.write("actuator_torque", 0.0)
        with pytest.raises(OutOfRange, match="no channel colour"):
            actuator.read("colour")


def test_killed_agent_leaves_a_drive_that_comes_to_rest_by_itself(rig):
    usual = replace(PATIENT, stale_after=0.1)
    actuator = Actuator(
        "actuator", CanAddress("socketcand", port=rig.server.port), time.monotonic_ns, settings=usual
    )
    actuator.connect()
    with Leader(actuator, sine):
        positions(actuator, 30)
    actuator._bus.close()
    wait_until(lambda: rig.drive.state is State.QUICK_STOP and rig.drive.demand.velocity == 0)
    assert rig.drive.objects.number(0x603F) == 0x8250
    here = rig.rod.position
    with connected(rig) as again:
        assert again._drive.state().value == "switch on disabled"
    assert rig.rod.position == here


def test_drive_stops_by_itself_when_only_the_heartbeat_is_lost(rig):
    settings = ActuatorSettings(stale_after=0.0, master_lost_after=0.2, master_beat=0.02, top_speed=5.0)
    with connected(rig, settings) as actuator:
        with Leader(actuator, lambda t: 0.0):
            positions(actuator, 20)
        wait_until(lambda: rig.drive.state is State.QUICK_STOP)
        wait_until(lambda: actuator.faults)
        assert actuator.faults[0].kind is FaultKind.MASTER_LOST


def test_late_setpoints_bring_no_heartbeat(rig):
    with connected(rig) as actuator:
        actuator.arm()
        beats = []
        actuator.listen(lambda frame: beats.append(frame) if unpack_frame(frame.data)[0] == 0x77F else None)
        actuator._setpoints._last_ns -= int(0.02e9)
        actuator.command(0.0)
        assert beats == []


def test_stop_of_the_drive_is_told_with_its_reason_and_needs_a_reset(rig):
    with connected(rig) as actuator:
        with Leader(actuator, sine) as leader:
            positions(actuator, 20)
            rig.drive.fail(0x4310)
            wait_until(lambda: leader.error)
        assert isinstance(leader.error, Refused)
        assert "over-temperature (emergency 4310h)" in str(leader.error)
        assert actuator.health().words == "over-temperature (emergency 4310h)"
        with pytest.raises(Refused, match="find the cause, then reset"):
            actuator.arm()
        actuator.reset()
        assert actuator.faults == ()
        actuator.arm()


def test_rod_that_does_not_follow_is_a_fault(rig):
    rig.rod.stuck = True
    with connected(rig) as actuator, Leader(actuator, lambda t: min(0.05 * t, 0.02)) as leader:
        wait_until(lambda: leader.error)
        assert actuator.faults[0].kind is FaultKind.FOLLOWING_ERROR


def test_torque_limit_holds_the_rod_back_until_it_no_longer_follows(rig):
    with connected(rig) as actuator:
        rig.rod.force = 5000.0
        with Leader(actuator, lambda t: min(0.05 * t, 0.02)) as leader:
            wait_until(lambda: leader.error)
        assert actuator.faults[0].kind is FaultKind.FOLLOWING_ERROR
        assert abs(rig.rod.position) < 1e-3


def test_made_safe_while_stroking_the_rod_stands(rig):
    with connected(rig) as actuator:
        with Leader(actuator, sine):
            positions(actuator, 20)
            actuator.make_safe()
        assert rig.drive.state is State.QUICK_STOP
        assert rig.drive.demand.velocity == 0
        assert actuator.health().words == ""


def test_rest_ends_leading_without_any_fault(rig):
    with connected(rig) as actuator:
        with Leader(actuator, lambda t: 0.0):
            positions(actuator, 20)
        actuator.rest()
        assert rig.drive.state is State.SWITCH_ON_DISABLED
        assert actuator.faults == ()
        actuator.arm()


def test_replay_of_the_recorded_frames_gives_the_same_samples(rig):
    frames = []
    with connected(rig) as actuator:
        actuator.listen(frames.append)
        with Leader(actuator, sine):
            live = np.concatenate([b.values for b in positions(actuator, 100)])
        again = actuator.decoder(actuator.origin, actuator.rated_torque)
    for frame in frames:
        again.take(frame)
    replayed = np.concatenate([b.values for b in again.blocks() if b.channel == "actuator_position"])
    assert np.array_equal(replayed[: len(live)], live)


def test_home_mount_centre_and_stroke():
    rig = CanRig(machine=Machine(switch=-0.004))
    rig.drive.objects.put(0x607C, -40_000)
    with connected(rig) as actuator:
        assert actuator.mounting is Mounting.UNMOUNTED
        with pytest.raises(Refused, match="home it first"):
            actuator.arm()
        actuator.home()
        assert actuator.mounting is Mounting.HOMED
        assert actuator.read("actuator_position").value == pytest.approx(-0.004)
        actuator.mount()
        actuator.centre()
        assert actuator.read("actuator_position").value == pytest.approx(0.0)
        assert actuator.channels[0].low == pytest.approx(-0.056)
        with Leader(actuator, lambda t: 0.002 * math.sin(2 * math.pi * t)):
            positions(actuator, 50)
        actuator.rest()
        with pytest.raises(Refused, match="a specimen is clamped"):
            actuator.home()
        actuator.unmount()
        assert actuator.mounting is Mounting.HOMED
    rig.close()


def test_homing_that_does_not_end_is_given_up_and_the_rod_stands():
    rig = CanRig(machine=Machine(switch=-0.05))
    with connected(rig) as actuator:
        with pytest.raises(NoReply, match=r"waited 0\.1 s for the reference"):
            actuator.home(within=0.1)
        assert actuator.mounting is Mounting.UNMOUNTED
        assert rig.drive.demand.velocity == 0
    rig.close()


def test_clamped_specimen_without_a_reference_is_stranded():
    rig = CanRig()
    with connected(rig, clamped=True) as actuator:
        assert actuator.mounting is Mounting.STRANDED
        with pytest.raises(Refused, match="unclamp the specimen"):
            actuator.arm()
    rig.close()


def test_frames_are_packed_as_linux_writes_them():
    assert unpack_frame(pack_frame(0x205, b"\x01\x02")) == (0x205, b"\x01\x02")
    assert len(pack_frame(0x80, b"")) == 16

"""What the actuator's driver makes of a bad wire: a typed error in time or a counted loss."""

import socket
import time

import numpy as np
import pytest
from can_rig import CanRig, Leader, connected, positions, sine, wait_until

from drivers.actuator import Actuator
from drivers.can_bus import CanAddress
from drivers.errors import BadReply, DriverError, NoReply, NotConnected, Refused
from sim_rig.drive_states import State

pytestmark = pytest.mark.timeout(60)


@pytest.fixture
def rig():
    rig = CanRig(referenced=True)
    yield rig
    rig.close()


def test_silent_drive_ends_in_no_reply_and_safety_does_not_raise(rig):
    with connected(rig) as actuator:
        with Leader(actuator, sine) as leader:
            positions(actuator, 20)
            rig.injection.silent = True
            wait_until(lambda: leader.error)
        assert isinstance(leader.error, (NoReply, Refused))
        with pytest.raises(NoReply, match="no heartbeat for"):
            wait_until(lambda: actuator.acquire(0.05) is None)
        actuator.make_safe()
        assert "quick stop not confirmed" in actuator.health().words
        wait_until(lambda: rig.drive.state is State.QUICK_STOP)
        rig.injection.silent = False


def test_answer_that_comes_late_is_never_taken_for_another(rig):
    with connected(rig) as actuator:
        rig.injection.late_sdo_ns = 400_000_000
        with pytest.raises(NoReply, match=r"6077h:00: no answer in 0.3 s"):
            actuator.read("actuator_torque")
        rig.injection.late_sdo_ns = 0
        rig.rod.force = 240.0
        assert actuator.read("actuator_torque").raw == 150


def test_answer_for_another_object_is_a_bad_reply_and_the_next_is_right(rig):
    with connected(rig) as actuator:
        rig.injection.corrupt_sdo = 1
        with pytest.raises(BadReply, match="instead"):
            actuator.read("actuator_torque")
        assert actuator.read("actuator_torque").raw == 75


def test_lost_process_data_is_counted_and_numbers_leap(rig):
    with connected(rig) as actuator, Leader(actuator, sine):
        positions(actuator, 20)
        rig.injection.dropped = 7
        wait_until(lambda: actuator.health().lost >= 4)
        blocks = positions(actuator, 100)
        assert actuator.health().lost == 4
        samples = actuator._samples
        assert samples._number == samples.received + samples.lost
        assert blocks


def test_cut_process_data_is_counted_and_not_used(rig):
    with connected(rig) as actuator, Leader(actuator, sine):
        positions(actuator, 20)
        rig.injection.short_pdo = 2
        wait_until(lambda: actuator.health().corrupted == 2)
        wait_until(lambda: actuator.health().lost == 1)
        values = np.concatenate([b.values for b in positions(actuator, 50)])
        assert np.all(np.abs(values) < 0.012)


def test_late_process_data_keeps_its_device_time_and_nothing_is_lost(rig):
    with connected(rig) as actuator, Leader(actuator, sine):
        positions(actuator, 20)
        rig.injection.late_ns = 20_000_000
        blocks = positions(actuator, 60)
        rig.injection.late_ns = 0
        stamps = np.concatenate([b.device_ns for b in blocks])
        assert np.all(np.diff(stamps) >= 0)
        positions(actuator, 60)
        assert actuator.health().lost == 0


def test_server_that_goes_away_is_not_connected_and_comes_back(rig):
    port = rig.server.port
    with connected(rig) as actuator:
        with Leader(actuator, sine) as leader:
            positions(actuator, 20)
            rig.server.close()
            wait_until(lambda: leader.error)
        assert isinstance(leader.error, NotConnected)
        with pytest.raises(NotConnected, match="gone"):
            wait_until(lambda: actuator.acquire(0.01) is None)
        assert not actuator.health().connected
        actuator.make_safe()
        rig.server = type(rig.server)([rig.drive], rig.rod.clock, port=port).start()
        actuator.connect()
        assert actuator.read("actuator_torque").raw == 75


def test_nobody_at_the_port_is_not_connected():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    actuator = Actuator("actuator", CanAddress("socketcand", port=port), time.monotonic_ns)
    with pytest.raises(NotConnected, match="cannot be opened"):
        actuator.connect()
    with pytest.raises(NotConnected, match="not open"):
        actuator.acquire(0.0)
    actuator.make_safe()
    actuator.close()


def test_server_that_never_greets_is_not_connected():
    with socket.create_server(("127.0.0.1", 0)) as mute:
        address = CanAddress("socketcand", port=mute.getsockname()[1])
        actuator = Actuator("actuator", address, time.monotonic_ns)
        actuator._bus._timeout = 0.1
        with pytest.raises(NotConnected, match=r"cannot be opened within 0\.1 s"):
            actuator.connect()


def test_unknown_bus_or_node_is_told(rig):
    address = CanAddress("socketcand", channel="can7", port=rig.server.port)
    with pytest.raises(NotConnected, match="can7"):
        Actuator("actuator", address, time.monotonic_ns).connect()
    right = CanAddress("socketcand", port=rig.server.port)
    with pytest.raises(NoReply, match="waited 1 s for a heartbeat"):
        Actuator("actuator", right, time.monotonic_ns, node_id=9).connect()


def test_device_that_is_no_drive_or_counts_otherwise_is_a_bad_reply(rig):
    rig.drive.objects.put(0x60A8, 0xFA010000)
    with pytest.raises(BadReply, match="60A8h reads FA010000h"), connected(rig):
        pass
    rig.drive.objects.put(0x1000, 0x191)
    with pytest.raises(BadReply, match="no CiA 402 drive"), connected(rig):
        pass


def test_drive_that_restarts_is_not_led_on(rig):
    with connected(rig) as actuator, Leader(actuator, sine) as leader:
        positions(actuator, 20)
        actuator._bus.send(0, bytes([129, 5]))
        wait_until(lambda: leader.error)
        assert isinstance(leader.error, DriverError)
        assert rig.drive.state is State.SWITCH_ON_DISABLED

"""The actuator's driver on a faulty wire: each fault is a typed error in time, or a counted loss."""

import socket
import time

import numpy as np
import pytest

from drivers.actuator.actuator import Actuator
from drivers.errors import DriverError, InvalidReplyError, NoReplyError, NotConnectedError, RefusedError
from drivers.transport.can_bus import CanAddress
from sim_rig.instruments.cia402_states import DriveState
from tests.support.can_rig import CanRig, SetpointThread, collect_positions, connected, sine, wait_until

pytestmark = pytest.mark.timeout(60)


@pytest.fixture
def rig():
    rig = CanRig(referenced=True)
    yield rig
    rig.close()


def test_a_silent_drive_is_no_reply_and_make_safe_does_not_raise(rig):
    with connected(rig) as actuator:
        with SetpointThread(actuator, sine) as sender:
            collect_positions(actuator, 20)
            rig.injection.silent = True
            wait_until(lambda: sender.error)
        assert isinstance(sender.error, (NoReplyError, RefusedError))
        with pytest.raises(NoReplyError, match="no heartbeat for"):
            wait_until(lambda: actuator.acquire(0.05) is None)
        assert "actuator" in actuator.make_safe()
        assert "quick stop not confirmed" in actuator.get_health().message
        wait_until(lambda: rig.drive.state is DriveState.QUICK_STOP)
        rig.injection.silent = False


def test_a_late_reply_is_not_taken_for_another(rig):
    with connected(rig) as actuator:
        rig.injection.sdo_delay_ns = 400_000_000
        with pytest.raises(NoReplyError, match=r"6077h:00: no reply in 0.3 s"):
            actuator.read("actuator_torque")
        rig.injection.sdo_delay_ns = 0
        rig.rod.force = 240.0
        assert actuator.read("actuator_torque").raw == 150


def test_a_reply_for_another_object_is_invalid_and_the_next_is_right(rig):
    with connected(rig) as actuator:
        rig.injection.corrupted_sdos = 1
        with pytest.raises(InvalidReplyError, match="instead"):
            actuator.read("actuator_torque")
        assert actuator.read("actuator_torque").raw == 75


def test_lost_process_data_is_counted_and_skipped_in_the_numbers(rig):
    with connected(rig) as actuator, SetpointThread(actuator, sine):
        collect_positions(actuator, 20)
        rig.injection.dropped_pdos = 7
        wait_until(lambda: actuator.get_health().lost >= 4)
        blocks = collect_positions(actuator, 100)
        assert actuator.get_health().lost == 4
        decoder = actuator._samples.decoder
        assert decoder._number == decoder.received + decoder.lost
        assert blocks


def test_truncated_process_data_is_counted_and_not_used(rig):
    with connected(rig) as actuator, SetpointThread(actuator, sine):
        collect_positions(actuator, 20)
        rig.injection.shortened_pdos = 2
        wait_until(lambda: actuator.get_health().corrupted == 2)
        wait_until(lambda: actuator.get_health().lost == 1)
        values = np.concatenate([b.values for b in collect_positions(actuator, 50)])
        assert np.all(np.abs(values) < 0.012)


def test_late_process_data_keeps_its_device_time_and_nothing_is_lost(rig):
    with connected(rig) as actuator, SetpointThread(actuator, sine):
        collect_positions(actuator, 20)
        rig.injection.pdo_delay_ns = 20_000_000
        blocks = collect_positions(actuator, 60)
        rig.injection.pdo_delay_ns = 0
        times = np.concatenate([b.device_ns for b in blocks])
        assert np.all(np.diff(times) >= 0)
        collect_positions(actuator, 60)
        assert actuator.get_health().lost == 0


def test_a_stopped_server_is_not_connected_until_it_is_restarted(rig):
    port = rig.server.port
    with connected(rig) as actuator:
        with SetpointThread(actuator, sine) as sender:
            collect_positions(actuator, 20)
            rig.server.close()
            wait_until(lambda: sender.error)
        assert isinstance(sender.error, NotConnectedError)
        with pytest.raises(NotConnectedError, match="gone"):
            wait_until(lambda: actuator.acquire(0.01) is None)
        assert not actuator.get_health().connected
        actuator.make_safe()
        rig.server = type(rig.server)([rig.drive], rig.rod.clock, port=port).start()
        actuator.connect()
        assert actuator.read("actuator_torque").raw == 75


def test_a_port_without_a_server_is_not_connected():
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    actuator = Actuator("actuator", CanAddress("socketcand", port=port), time.monotonic_ns)
    with pytest.raises(NotConnectedError, match="cannot be opened"):
        actuator.connect()
    with pytest.raises(NotConnectedError, match="not open"):
        actuator.acquire(0.0)
    actuator.make_safe()
    actuator.close()


def test_a_server_without_a_greeting_is_not_connected():
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = CanAddress("socketcand", port=server.getsockname()[1])
        actuator = Actuator("actuator", address, time.monotonic_ns)
        actuator._bus._timeout = 0.1
        with pytest.raises(NotConnectedError, match=r"cannot be opened within 0\.1 s"):
            actuator.connect()


def test_an_unknown_bus_or_node_is_reported(rig):
    address = CanAddress("socketcand", channel="can7", port=rig.server.port)
    with pytest.raises(NotConnectedError, match="can7"):
        Actuator("actuator", address, time.monotonic_ns).connect()
    address = CanAddress("socketcand", port=rig.server.port)
    with pytest.raises(NoReplyError, match="waited 1 s for a heartbeat"):
        Actuator("actuator", address, time.monotonic_ns, node_id=9).connect()


def test_another_device_or_other_units_are_an_invalid_reply(rig):
    rig.drive.objects.set_value(0x60A8, 0xFA010000)
    with pytest.raises(InvalidReplyError, match="60A8h reads FA010000h"), connected(rig):
        pass
    rig.drive.objects.set_value(0x1000, 0x191)
    with pytest.raises(InvalidReplyError, match="not a CiA 402 drive"), connected(rig):
        pass


def test_a_restarted_drive_gets_no_setpoints(rig):
    with connected(rig) as actuator, SetpointThread(actuator, sine) as sender:
        collect_positions(actuator, 20)
        actuator._bus.send(0, bytes([129, 5]))
        wait_until(lambda: sender.error)
        assert isinstance(sender.error, DriverError)
        assert rig.drive.state is DriveState.SWITCH_ON_DISABLED

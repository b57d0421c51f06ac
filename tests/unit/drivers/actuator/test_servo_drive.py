"""Actuator and drive with invalid settings and failed operations, without a bus."""

from types import SimpleNamespace

import pytest

from drivers.actuator.actuator import Actuator
from drivers.actuator.reference_state import ReferenceState
from drivers.actuator.servo_drive import ServoDrive
from drivers.errors import InvalidReplyError, NoReplyError, OutOfRangeError, RefusedError
from drivers.transport.can_bus import CanAddress, CanBus
from drivers.transport.canopen_node import CanopenNode
from drivers.wire_files import ACTUATOR_EDS

NOWHERE = CanAddress("virtual", "nowhere")


def clock():
    return 0


def test_a_drive_without_a_rated_torque_is_refused():
    objects = {0x1000: 0x192, 0x60A8: 0xF9010000, 0x60A9: 0xF9010300, 0x6076: 0}
    drive = ServoDrive("rod", SimpleNamespace(read_number=objects.__getitem__))
    with pytest.raises(InvalidReplyError, match=r"rated torque \(6076h\) reads 0 mN m; enter"):
        drive._identify()


def test_a_value_that_does_not_fit_its_object_is_not_sent():
    node = CanopenNode("rod", CanBus(NOWHERE, clock), 5, ACTUATOR_EDS, clock)
    with pytest.raises(OutOfRangeError, match=r"rod: 120000 does not fit object 6072h:00 .*nothing was sent"):
        node.download(0x6072, 120_000)


def test_failed_homing_leaves_no_reference(monkeypatch):
    actuator = Actuator("rod", NOWHERE, clock)
    actuator._reference_state = ReferenceState.HOMED

    def fail(method, timeout):
        raise NoReplyError("rod: waited 30 s for the reference")

    monkeypatch.setattr(actuator._drive, "home", fail)
    with pytest.raises(NoReplyError):
        actuator.home()
    assert actuator.reference_state is ReferenceState.UNREFERENCED
    with pytest.raises(RefusedError, match="the rod's position is not referenced; home it first"):
        actuator.arm()

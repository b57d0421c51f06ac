"""The actuator and its drive where something is amiss, without a bus."""

from pathlib import Path
from types import SimpleNamespace

import pytest

import drivers
from drivers.actuator import Actuator
from drivers.can_bus import CanAddress, CanBus
from drivers.canopen_node import CanopenNode
from drivers.errors import BadReply, NoReply, OutOfRange, Refused
from drivers.mounting import Mounting
from drivers.servo_drive import ServoDrive

NOWHERE = CanAddress("virtual", "nowhere")
EDS = Path(drivers.__file__).parent / "wire" / "actuator.eds"


def clock():
    return 0


def test_a_drive_that_does_not_know_its_motor_is_a_bad_reply():
    objects = {0x1000: 0x192, 0x60A8: 0xF9010000, 0x60A9: 0xF9010300, 0x6076: 0}
    drive = ServoDrive("rod", SimpleNamespace(number=objects.__getitem__))
    with pytest.raises(BadReply, match=r"rated torque \(6076h\) reads 0 mN m; enter"):
        drive._identify()


def test_a_value_that_its_object_cannot_hold_is_never_sent():
    node = CanopenNode("rod", CanBus(NOWHERE, clock), 5, EDS, clock)
    with pytest.raises(OutOfRange, match=r"rod: 120000 does not fit object 6072h:00 .*nothing was sent"):
        node.download(0x6072, 120_000)


def test_a_search_that_ends_early_leaves_no_reference(monkeypatch):
    actuator = Actuator("rod", NOWHERE, clock)
    actuator._mounting = Mounting.HOMED

    def lost(method, within):
        raise NoReply("rod: waited 30 s for the reference")

    monkeypatch.setattr(actuator._drive, "home", lost)
    with pytest.raises(NoReply):
        actuator.home()
    assert actuator.mounting is Mounting.UNMOUNTED
    with pytest.raises(Refused, match="the rod does not know where it is; home it first"):
        actuator.arm()

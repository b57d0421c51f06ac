"""Actuator and drive with invalid settings and failed operations, without a bus."""

from types import SimpleNamespace

import pytest

from drivers.actuator.actuator import Actuator
from drivers.actuator.channels import make_channels
from drivers.actuator.reference_state import ReferenceState
from drivers.actuator.sample_reader import SampleReader
from drivers.actuator.servo_drive import ActuatorSettings, ServoDrive
from drivers.errors import InvalidReplyError, NoReplyError, OutOfRangeError, RefusedError
from drivers.transport.can_bus import CanAddress, CanBus
from drivers.transport.canopen_node import CanopenNode
from drivers.transport.canopen_pdo import read_mapping
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


def test_a_reply_reaches_the_network_with_its_time_in_seconds(monkeypatch):
    node = CanopenNode("rod", CanBus(NOWHERE, clock), 5, ACTUATOR_EDS, clock)
    received = []
    monkeypatch.setattr(node._network, "notify", lambda *frame: received.append(frame))
    node._on_frame(2_500_000_000, 0x585, b"\x43\x00")
    node._on_frame(2_600_000_000, 0x586, b"of another node")
    assert received == [(0x585, bytearray(b"\x43\x00"), 2.5)]


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


def test_channels_count_from_the_origin_and_extend_beyond_the_limits():
    """Travel from -60 mm to 60 mm; four times 0.5 m/s and four times the rated torque."""
    channels = make_channels(ActuatorSettings(), 0.01, 0.64)
    assert [(one.name, one.unit) for one in channels] == [
        ("actuator_position", "m"), ("actuator_velocity", "m/s"), ("actuator_torque", "N m")
    ]  # fmt: skip
    assert [one.low for one in channels] == pytest.approx([-0.07, -2.0, -2.56])
    assert [one.high for one in channels] == pytest.approx([0.05, 2.0, 2.56])


@pytest.mark.parametrize(
    ("channel", "index", "value"),
    [
        ("actuator_position", 0x6064, 0.0075),  # 250 000 counts of 0.1 um, less an origin of 17.5 mm
        ("actuator_velocity", 0x606C, 0.025),
        ("actuator_torque", 0x6077, 160.0),  # per mille of 0.64 N m
    ],
)
def test_a_requested_value_is_in_si_units(channel, index, value):
    actuator = Actuator("rod", NOWHERE, lambda: 77)
    actuator._origin, actuator._drive.rated_torque = 0.0175, 0.64
    actuator._node.read_number = {index: 250_000}.__getitem__
    reading = actuator.read(channel)
    assert reading.value == pytest.approx(value)
    assert (reading.received_ns, reading.device_ns, reading.raw) == (77, None, 250_000)


def test_samples_have_the_torque_in_thousandths_of_the_rated_one():
    node = CanopenNode("rod", CanBus(NOWHERE, clock), 5, ACTUATOR_EDS, clock)
    decoder = SampleReader(CanBus(NOWHERE, clock), node, clock, 0.004).make_decoder(0.01, 0.64)
    assert decoder._scale.tolist() == [[1e-7], [1e-7], [pytest.approx(0.64e-3)]]
    assert decoder.origin == 0.01


def test_synchronous_frames_are_those_up_to_transmission_type_240():
    entry = SimpleNamespace(index=0x6064, offset=16, length=32, od=SimpleNamespace(data_type=4))

    class Pdo(list):
        cob_id, length = 0x185, 48

    def is_on_sync(kind):
        pdo = Pdo([entry])
        pdo.trans_type = kind
        return read_mapping(pdo)

    assert is_on_sync(240) == (0x185, 6, True, ((0x6064, 2, 4, True),))
    assert [is_on_sync(kind).on_sync for kind in (1, 241, 254)] == [True, False, False]

"""Simulated CANopen node without a bus: frames in, frames out, at times set by the test."""

import math
import struct
from pathlib import Path

import numpy as np
import pytest

from sim_rig.instruments.cia402_states import DriveState
from sim_rig.instruments.encoder import DriveMechanics, compute_torque
from sim_rig.instruments.servo_drive import ServoDriveDevice
from sim_rig.protocols.object_dictionary import ObjectDictionary, SdoAbortError
from sim_rig.scenario.scenario import load_scenario
from sim_rig.server.bench_toml import Wire, make_bench_toml

EDS = Path(__file__).parents[4] / "drivers" / "wire" / "actuator.eds"
NODE, MS = 5, 1_000_000


class Rod:
    """Interface of a rig whose rod is at rest."""

    def __init__(self):
        self.position, self.force = 0.001, 0.0
        self.now = 0

    def now_ns(self):
        return self.now

    def read_latest(self, channel, count, before_ns):
        value = {"actuator_position": self.position, "force": self.force}[channel]
        times = before_ns - MS * np.arange(count - 1, -1, -1)
        return times, np.full(count, value)

    def schedule_position(self, position, at_ns, since_ns):
        self.position = position

    def command(self, channel, value, at_ns=None):
        self.position = value


class Node:
    """An actuator, and the frames that it sent."""

    def __init__(self, **mechanics):
        self.rod, self.sent = Rod(), []
        self.drive = ServoDriveDevice(
            self.rod, node_id=NODE, referenced=True, mechanics=DriveMechanics(**mechanics)
        )
        self.drive.join(lambda identifier, data, at_ns: self.sent.append((identifier, data)), 0)

    def frames(self, identifier):
        return [data for sender, data in self.sent if sender == identifier]

    def request(self, data, at_ns=0):
        """Return the reply to an SDO request."""
        self.sent.clear()
        self.drive.receive(0x600 + NODE, bytes(data), at_ns)
        (reply,) = self.frames(0x580 + NODE)
        return reply

    def read(self, index, sub=0, at_ns=0):
        reply = self.request(struct.pack("<BHB4x", 0x40, index, sub), at_ns)
        assert reply[0] & 0xE3 == 0x43, reply.hex()
        return int.from_bytes(reply[4 : 8 - (reply[0] >> 2 & 3)], "little")

    def write(self, index, value, size, sub=0, at_ns=0):
        head = 0x23 | (4 - size) << 2
        data = struct.pack("<BHB", head, index, sub) + value.to_bytes(4, "little", signed=value < 0)
        return self.request(data, at_ns)

    def command(self, state):
        self.drive.receive(0x000, bytes([state, NODE]), 0)


def get_abort_code(reply):
    return struct.unpack("<I", reply[4:])[0] if reply[0] == 0x80 else None


@pytest.fixture
def node():
    return Node()


def test_it_announces_itself_and_sends_heartbeats_at_the_configured_period(node):
    assert node.frames(0x700 + NODE) == [b"\x00"]
    node.write(0x1017, 50, 2)
    node.sent.clear()
    for at in range(0, 201, 10):
        node.drive.tick(at * MS)
    assert node.frames(0x700 + NODE)[-4:] == [b"\x7f"] * 4
    assert len(node.frames(0x700 + NODE)) in (4, 5)


@pytest.mark.parametrize(("command", "state"), [(1, b"\x05"), (2, b"\x04"), (128, b"\x7f")])
def test_a_network_command_changes_the_state_in_the_heartbeat(node, command, state):
    node.write(0x1017, 10, 2)
    node.command(command)
    node.sent.clear()
    for at in (2000, 2020, 2040):
        node.drive.tick(at * MS)
    assert set(node.frames(0x700 + NODE)) == {state}


def test_a_stopped_node_sends_no_sdo_reply(node):
    node.command(2)
    node.sent.clear()
    node.drive.receive(0x600 + NODE, struct.pack("<BHB4x", 0x40, 0x1000, 0), 0)
    assert node.sent == []


@pytest.mark.parametrize(
    ("request_", "code"),
    [
        (struct.pack("<BHB4x", 0x40, 0x5FFF, 0), 0x06020000),
        (struct.pack("<BHB4x", 0x40, 0x60C2, 9), 0x06090011),
        (struct.pack("<BHBI", 0x23, 0x6076, 0, 5), 0x06010002),
        (struct.pack("<BHBI", 0x23, 0x6072, 0, 5), 0x06070010),
        (struct.pack("<BHBI", 0x2B, 0x6072, 0, 4000), 0x06090031),
        (struct.pack("<BHB4x", 0xE0, 0x6072, 0), 0x05040001),
    ],
)
def test_an_invalid_request_is_aborted_with_its_code(node, request_, code):
    assert get_abort_code(node.request(request_)) == code


def test_a_long_object_is_transferred_in_alternating_segments(node):
    first = node.request(struct.pack("<BHB4x", 0x40, 0x1008, 0))
    assert first[0] == 0x41
    size, content, toggle = struct.unpack("<I", first[4:])[0], b"", 0
    while True:
        part = node.request(struct.pack("<B7x", 0x60 | toggle))
        content += part[1 : 8 - (part[0] >> 1 & 7)]
        if part[0] & 1:
            break
        toggle ^= 0x10
    assert len(content) == size
    assert content.decode("ascii").isprintable()


def test_a_segment_with_the_wrong_toggle_bit_is_refused(node):
    node.request(struct.pack("<BHB4x", 0x40, 0x1008, 0))
    assert get_abort_code(node.request(struct.pack("<B7x", 0x70))) == 0x05030000


def test_the_masters_heartbeat_is_monitored_from_its_first_one(node):
    node.drive.state = DriveState.ENABLED
    node.write(0x1016, 127 << 16 | 100, 4, 1)
    node.drive.tick(1000 * MS)
    assert node.drive.state is DriveState.ENABLED
    node.drive.receive(0x700 + 127, b"\x05", 1000 * MS)
    node.drive.tick(1099 * MS)
    assert node.drive.state is DriveState.ENABLED
    node.drive.tick(1101 * MS)
    assert node.drive.state is DriveState.QUICK_STOP
    assert [struct.unpack("<HB", data[:3]) for data in node.frames(0x80 + NODE)] == [(0x8130, 0x11)]


def test_a_nan_position_is_a_fault_in_the_statusword(node):
    assert node.read(0x6041, at_ns=1 * MS) & 0x6F == 0x40
    node.rod.position = math.nan
    assert node.read(0x6041, at_ns=2 * MS) & 0x4F == 0x08
    assert [struct.unpack("<H", data[:2]) for data in node.frames(0x80 + NODE)] == [(0x7320,)]
    assert node.drive.state is DriveState.FAULT


def test_the_torque_is_relative_to_the_rated_torque_of_the_motor():
    node = Node(torque=compute_torque(4000.0))
    node.rod.force = 1000.0
    assert node.read(0x6076) == round(1e3 * 4000 * 5e-3 / (2 * math.pi))
    assert node.read(0x6077, at_ns=1 * MS) == pytest.approx(250, abs=1)


@pytest.mark.parametrize(("scenario", "force"), [("default", 1600.0), ("lord_class", 5000.0)])
def test_a_scenario_defines_the_force_of_its_actuator(scenario, force):
    assert load_scenario(scenario).actuator.force == force


def test_the_configuration_contains_the_torque_limit_of_the_motor():
    wire = Wire("actuator", "CANopen", {"driver": "actuator", "interface": "socketcand", "torque_limit": 3.183})
    assert "torque_limit = 3.183" in make_bench_toml([wire], load_scenario("lord_class"))


@pytest.mark.parametrize(
    ("index", "data", "code"),
    [(0x6072, b"\x00\x00\x00", 0x06070010), (0x6072, b"\xff\xff", 0x06090031), (0x6041, b"\x00\x00", 0x06010002)],
)
def test_an_object_refuses_values_outside_its_data_sheet(index, data, code):
    objects = ObjectDictionary(EDS, NODE)
    with pytest.raises(SdoAbortError) as refused:
        objects.download(index, 0, data)
    assert refused.value.code == code


def test_identifiers_of_process_data_contain_the_node():
    assert ObjectDictionary(EDS, 7).get_number(0x1400, 1) == 0x207
    assert ObjectDictionary(EDS, 9).get_number(0x1400, 1) == 0x209


def test_the_drive_needs_ticks_only_while_it_moves_without_punctual_setpoints(node):
    node.command(1)
    assert not node.drive.acts_by_itself(0)
    for turn, word in enumerate((6, 7, 15, 15)):
        node.drive.receive(0x200 + NODE, struct.pack("<Hbi", word, 8, 10_000), 4 * turn * MS)
        node.drive.receive(0x80, b"", 4 * turn * MS)
    assert node.drive.state is DriveState.ENABLED
    assert not node.drive.acts_by_itself(17 * MS)
    assert node.drive.acts_by_itself(18 * MS)
    for at in range(18, 1000):
        node.drive.tick(at * MS)
    assert node.drive.state is DriveState.QUICK_STOP
    assert not node.drive.acts_by_itself(1000 * MS)

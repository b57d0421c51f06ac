"""The simulated CANopen node without a bus: frames in, frames out, on a time that the test says."""

import math
import struct
from pathlib import Path

import numpy as np
import pytest

from sim_rig.canopen_actuator import CanopenActuator
from sim_rig.drive_senses import Machine, torque_for
from sim_rig.drive_states import State
from sim_rig.object_dictionary import Abort, ObjectDictionary
from sim_rig.scenario import load_scenario
from sim_rig.serve import Wire, bench_toml

EDS = Path(__file__).parents[3] / "drivers" / "wire" / "actuator.eds"
NODE, MS = 5, 1_000_000


class Rod:
    """Signals of a rod that stands."""

    def __init__(self):
        self.position, self.force = 0.001, 0.0
        self.now = 0

    def now_ns(self):
        return self.now

    def latest(self, channel, count, before_ns):
        value = {"actuator_position": self.position, "force": self.force}[channel]
        times = before_ns - MS * np.arange(count - 1, -1, -1)
        return times, np.full(count, value)

    def lead(self, position, at_ns, since_ns):
        self.position = position

    def command(self, channel, value, at_ns=None):
        self.position = value


class Node:
    """An actuator, and all that it has put on the bus."""

    def __init__(self, **machine):
        self.rod, self.sent = Rod(), []
        self.drive = CanopenActuator(self.rod, node_id=NODE, referenced=True, machine=Machine(**machine))
        self.drive.join(lambda identifier, data, at_ns: self.sent.append((identifier, data)), 0)

    def frames(self, identifier):
        return [data for one, data in self.sent if one == identifier]

    def asked(self, data, at_ns=0):
        """The answer to a request for an object."""
        self.sent.clear()
        self.drive.take(0x600 + NODE, bytes(data), at_ns)
        (answer,) = self.frames(0x580 + NODE)
        return answer

    def read(self, index, sub=0, at_ns=0):
        answer = self.asked(struct.pack("<BHB4x", 0x40, index, sub), at_ns)
        assert answer[0] & 0xE3 == 0x43, answer.hex()
        return int.from_bytes(answer[4 : 8 - (answer[0] >> 2 & 3)], "little")

    def write(self, index, value, size, sub=0, at_ns=0):
        head = 0x23 | (4 - size) << 2
        request = struct.pack("<BHB", head, index, sub) + value.to_bytes(4, "little", signed=value < 0)
        return self.asked(request, at_ns)

    def command(self, state):
        self.drive.take(0x000, bytes([state, NODE]), 0)


def aborted(answer):
    return struct.unpack("<I", answer[4:])[0] if answer[0] == 0x80 else None


@pytest.fixture
def node():
    return Node()


def test_it_announces_itself_and_beats_as_often_as_it_was_told(node):
    assert node.frames(0x700 + NODE) == [b"\x00"]
    node.write(0x1017, 50, 2)
    node.sent.clear()
    for at in range(0, 201, 10):
        node.drive.tick(at * MS)
    assert node.frames(0x700 + NODE)[-4:] == [b"\x7f"] * 4
    assert len(node.frames(0x700 + NODE)) in (4, 5)


@pytest.mark.parametrize(("command", "state"), [(1, b"\x05"), (2, b"\x04"), (128, b"\x7f")])
def test_a_network_command_changes_what_its_heart_says(node, command, state):
    node.write(0x1017, 10, 2)
    node.command(command)
    node.sent.clear()
    for at in (2000, 2020, 2040):
        node.drive.tick(at * MS)
    assert set(node.frames(0x700 + NODE)) == {state}


def test_a_stopped_node_answers_no_question(node):
    node.command(2)
    node.sent.clear()
    node.drive.take(0x600 + NODE, struct.pack("<BHB4x", 0x40, 0x1000, 0), 0)
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
def test_what_cannot_be_done_is_refused_by_its_code(node, request_, code):
    assert aborted(node.asked(request_)) == code


def test_a_long_object_comes_in_segments_that_alternate(node):
    first = node.asked(struct.pack("<BHB4x", 0x40, 0x1008, 0))
    assert first[0] == 0x41
    size, content, toggle = struct.unpack("<I", first[4:])[0], b"", 0
    while True:
        part = node.asked(struct.pack("<B7x", 0x60 | toggle))
        content += part[1 : 8 - (part[0] >> 1 & 7)]
        if part[0] & 1:
            break
        toggle ^= 0x10
    assert len(content) == size
    assert content.decode("ascii").isprintable()


def test_a_segment_out_of_turn_is_refused(node):
    node.asked(struct.pack("<BHB4x", 0x40, 0x1008, 0))
    assert aborted(node.asked(struct.pack("<B7x", 0x70))) == 0x05030000


def test_the_masters_heartbeat_is_watched_from_the_first_one_on(node):
    node.drive.state = State.ENABLED
    node.write(0x1016, 127 << 16 | 100, 4, 1)
    node.drive.tick(1000 * MS)
    assert node.drive.state is State.ENABLED
    node.drive.take(0x700 + 127, b"\x05", 1000 * MS)
    node.drive.tick(1099 * MS)
    assert node.drive.state is State.ENABLED
    node.drive.tick(1101 * MS)
    assert node.drive.state is State.QUICK_STOP
    assert [struct.unpack("<HB", data[:3]) for data in node.frames(0x80 + NODE)] == [(0x8130, 0x11)]


def test_a_position_that_is_no_number_is_a_fault_and_shows_in_the_statusword(node):
    assert node.read(0x6041, at_ns=1 * MS) & 0x6F == 0x40
    node.rod.position = math.nan
    assert node.read(0x6041, at_ns=2 * MS) & 0x4F == 0x08
    assert [struct.unpack("<H", data[:2]) for data in node.frames(0x80 + NODE)] == [(0x7320,)]
    assert node.drive.state is State.FAULT


def test_torque_is_told_as_a_share_of_the_motor_that_the_rig_has():
    node = Node(torque=torque_for(4000.0))
    node.rod.force = 1000.0
    assert node.read(0x6076) == round(1e3 * 4000 * 5e-3 / (2 * math.pi))
    assert node.read(0x6077, at_ns=1 * MS) == pytest.approx(250, abs=1)


@pytest.mark.parametrize(("scenario", "force"), [("default", 1600.0), ("lord_class", 5000.0)])
def test_a_scenario_says_how_hard_its_actuator_can_push(scenario, force):
    assert load_scenario(scenario).actuator.force == force


def test_a_section_of_the_configuration_says_what_the_motor_may_give():
    wire = Wire("actuator", "CANopen", {"driver": "actuator", "interface": "socketcand", "torque": 3.183})
    assert "torque = 3.183" in bench_toml([wire], load_scenario("lord_class"))


@pytest.mark.parametrize(
    ("index", "data", "code"),
    [(0x6072, b"\x00\x00\x00", 0x06070010), (0x6072, b"\xff\xff", 0x06090031), (0x6041, b"\x00\x00", 0x06010002)],
)
def test_an_object_takes_what_its_data_sheet_says(index, data, code):
    objects = ObjectDictionary(EDS, NODE)
    with pytest.raises(Abort) as refused:
        objects.download(index, 0, data)
    assert refused.value.code == code


def test_identifiers_of_process_data_carry_the_node():
    assert ObjectDictionary(EDS, 7).number(0x1400, 1) == 0x207
    assert ObjectDictionary(EDS, 9).number(0x1400, 1) == 0x209

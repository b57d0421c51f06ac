"""Simulated drive, tested by a plain canopen node that shares no code with the driver."""

import math
import time

import canopen
import pytest

from drivers.wire_files import ACTUATOR_EDS
from sim_rig.instruments.cia402_states import DriveState
from tests.support.can_rig import CanRig, wait_until

pytestmark = pytest.mark.timeout(60)


@pytest.fixture
def rig():
    rig = CanRig(referenced=True)
    yield rig
    rig.close()


@pytest.fixture
def node(rig):
    network = canopen.Network()
    network.NOTIFIER_CYCLE = 0.05
    network.connect(interface="socketcand", channel="can0", host="127.0.0.1", port=rig.server.port)
    node = network.add_node(5, str(ACTUATOR_EDS))
    node.sdo.RESPONSE_TIMEOUT = 2.0
    yield node
    network.disconnect()


def switch_on(node) -> None:
    """Enable operation in cyclic synchronous position mode, by object access."""
    node.sdo[0x6060].raw = 8
    for word in (0x06, 0x07, 0x0F):
        node.sdo[0x6040].raw = word
    assert node.sdo[0x6041].raw & 0x6F == 0x27


def send(node, target: int, controlword: int = 0x0F) -> None:
    """Send one setpoint and a SYNC."""
    pdo = node.rpdo[1]
    pdo[0x6040].raw, pdo[0x6060].raw, pdo[0x607A].raw = controlword, 8, target
    pdo.transmit()
    node.network.sync.transmit()


@pytest.fixture
def operational(node):
    node.tpdo.read()
    node.rpdo.read()
    node.nmt.state = "OPERATIONAL"
    return node


def test_objects_are_read_as_in_the_data_sheet(node):
    assert node.sdo[0x1000].raw == 0x20192
    assert node.sdo[0x1018][2].raw == 0x4D524231
    assert node.sdo[0x1008].raw == "MR bench servo actuator, 0.1 um"
    assert node.sdo[0x60C2][1].raw == 4
    assert node.sdo[0x607D][1].phys == pytest.approx(-0.062)
    assert node.sdo[0x1800][1].raw == 0x40000185


def test_every_object_of_the_data_sheet_can_be_read(node):
    for entry in node.object_dictionary.values():
        variables = [entry] if isinstance(entry, canopen.objectdictionary.ODVariable) else entry.values()
        for variable in variables:
            assert node.sdo.upload(variable.index, variable.subindex) is not None


def test_valid_writes_are_stored_and_wrong_ones_aborted_with_the_right_code(node):
    node.sdo.download(0x6065, 0, (12_345).to_bytes(4, "little"), force_segment=True)
    assert node.sdo[0x6065].raw == 12_345
    for index, data, code in (
        (0x6041, b"\x00\x00", 0x06010002),
        (0x6072, (4000).to_bytes(2, "little"), 0x06090031),
        (0x6072, b"\x00\x00\x00", 0x06070010),
        (0x5FFF, b"\x00", 0x06020000),
    ):
        with pytest.raises(canopen.SdoAbortedError) as aborted:
            node.sdo.download(index, 0, data)
        assert aborted.value.code == code
    with pytest.raises(canopen.SdoAbortedError) as aborted:
        node.sdo.upload(0x607D, 9)
    assert aborted.value.code == 0x06090011


def test_network_commands_change_the_state_in_the_heartbeat(node):
    node.sdo[0x1017].raw = 20
    for state in ("OPERATIONAL", "STOPPED", "PRE-OPERATIONAL"):
        node.nmt.state = state
        node.nmt.wait_for_heartbeat(2)
        wait_until(lambda state=state: node.nmt.wait_for_heartbeat(2) == state)


def test_reset_brings_a_boot_up_message(node):
    states = []
    node.nmt.add_heartbeat_callback(states.append)
    node.nmt.state = "RESET"
    wait_until(lambda: 0 in states)


def test_setpoints_by_process_data_are_interpolated_and_give_samples(rig, operational):
    node = operational
    samples = []
    node.tpdo[1].add_callback(lambda pdo: samples.append((pdo[0x6064].raw, pdo[0x1013].raw)))
    node.sdo[0x1400][5].raw = 1000
    switch_on(node)
    for target in range(0, 20_001, 200):
        send(node, target)
        time.sleep(0.004)  # the pace of the setpoints
    wait_until(lambda: abs(rig.rod.position - 2e-3) < 2e-4)
    wait_until(lambda: len(samples) == 101)
    positions = [position for position, _ in samples]
    assert positions[0] == 0
    assert max(positions) > 15_000
    assert samples[-1][1] > samples[0][1]
    assert node.tpdo[2][0x6077].raw == round(120 * 5e-3 / (2 * math.pi) / 1.27 * 1000)


def test_stale_setpoints_cause_a_quick_stop_an_emergency_and_a_latched_state(rig, operational):
    node = operational
    emergencies = []
    node.emcy.add_callback(emergencies.append)
    switch_on(node)
    send(node, 100)
    wait_until(lambda: emergencies)
    assert emergencies[0].code == 0x8250
    assert rig.drive.state is DriveState.QUICK_STOP
    node.sdo[0x6040].raw = 0x0F
    assert node.sdo[0x6041].raw & 0x6F == 0x07
    node.sdo[0x6040].raw = 0x00
    assert node.sdo[0x6041].raw & 0x4F == 0x40
    wait_until(lambda: emergencies[-1].code == 0)


def test_lost_master_heartbeat_stops_the_drive(rig, operational):
    node = operational
    node.sdo[0x1400][5].raw = 0
    node.sdo[0x1016][1].raw = 127 << 16 | 100
    switch_on(node)
    node.network.send_message(0x77F, b"\x05")
    wait_until(lambda: rig.drive.state is DriveState.QUICK_STOP)
    assert node.sdo[0x603F].raw == 0x8130


@pytest.mark.parametrize(
    ("reaction", "state"),
    [
        (0, DriveState.ENABLED),
        (1, DriveState.FAULT),
        (2, DriveState.SWITCH_ON_DISABLED),
        (3, DriveState.QUICK_STOP),
    ],
)
def test_reaction_to_a_lost_master_is_that_of_6007(rig, operational, reaction, state):
    operational.sdo[0x6007].raw = reaction
    operational.sdo[0x1400][5].raw = 0
    switch_on(operational)
    rig.drive.on_master_lost(rig.rod.now_ns())
    wait_until(lambda: rig.drive.state is state)


def test_target_outside_the_software_limits_is_a_fault(rig, operational):
    node = operational
    switch_on(node)
    send(node, 700_000)
    wait_until(lambda: rig.drive.state is DriveState.FAULT)
    assert node.sdo[0x603F].raw == 0x8612
    assert node.sdo[0x1003][1].raw == 0x8612
    node.sdo[0x6040].raw = 0x80
    assert rig.drive.state is DriveState.SWITCH_ON_DISABLED


def test_short_process_data_are_reported_and_not_used(rig, operational):
    emergencies = []
    operational.emcy.add_callback(emergencies.append)
    operational.network.send_message(0x205, b"\x0f\x00")
    wait_until(lambda: emergencies)
    assert emergencies[0].code == 0x8210
    assert rig.drive.state is DriveState.SWITCH_ON_DISABLED


def test_the_bus_load_is_that_of_the_frames(rig, operational):
    bits = rig.server.timing.bits
    operational.sdo[0x1017].raw = 0
    frames = rig.server.timing.frames
    for _ in range(10):
        operational.sdo[0x6041].raw  # noqa: B018 - the access is what counts
    assert rig.server.timing.frames - frames <= 22
    assert rig.server.timing.bits > bits
    assert 0 < rig.server.compute_load() < 1

"""Simulated instruments, tested by a plain pymodbus client and a plain socket, without the code of the drivers."""

import socket
import struct

import pytest
from pymodbus import FramerType
from pymodbus.client import ModbusSerialClient, ModbusTcpClient

from sim_rig.instruments.coil_amplifier import CoilAmplifierDevice
from sim_rig.instruments.modbus_sensor import SensorDevice
from sim_rig.live.device_clock import DeviceClock
from sim_rig.protocols.modbus_server import ReplyFault
from tests.support.modbus_bench import MS, FakeSignals, serve, truth

pytestmark = pytest.mark.timeout(60)


def make_client(server):
    if server.address.startswith("/dev/"):
        return ModbusSerialClient(server.address, baudrate=115200, timeout=1, retries=0)
    port = int(server.address.rpartition(":")[2])
    framer = FramerType.SOCKET if server.address.startswith("tcp") else FramerType.RTU
    return ModbusTcpClient("127.0.0.1", port=port, framer=framer, timeout=1, retries=0)


@pytest.fixture(params=["tcp", "rtu over socket", "rtu over pty"])
def lvdt(request):
    signals = FakeSignals()
    with serve(SensorDevice("lvdt", signals, DeviceClock(1_000_000_000)), request.param) as (server, _):
        client = make_client(server)
        assert client.connect()
        yield client, server, signals
        client.close()


def number(client, registers, type_):
    return client.convert_from_registers(registers, getattr(client.DATATYPE, type_))


def test_a_plain_client_reads_the_displacement(lvdt):
    client, _, signals = lvdt
    registers = client.read_input_registers(0, count=13).registers
    assert registers[0] == 0x4C56
    assert number(client, registers[2:4], "UINT32") == 1000
    assert number(client, registers[4:6], "UINT32") == 5000
    assert number(client, registers[6:8], "UINT32") == 6_000_000
    signals.step(250)
    value = number(client, client.read_input_registers(8, count=2).registers, "INT32") * 1e-7
    assert value == pytest.approx(truth("displacement", 5_250 * MS), abs=1e-7)


def test_a_plain_client_reads_the_ring_again_and_again(lvdt):
    client, _, signals = lvdt
    client.write_registers(0, client.convert_to_registers(4000, client.DATATYPE.UINT32))
    block = client.read_input_registers(100, count=125).registers
    assert number(client, block[1:3], "UINT32") == 4000
    assert block[9] == 57
    assert number(client, block[3:5], "UINT32") == 5_000_000
    for index in range(57):
        raw = number(client, block[11 + 2 * index : 13 + 2 * index], "INT32")
        assert raw * 1e-7 == pytest.approx(truth("displacement", (4000 + index) * MS), abs=1e-7)
    signals.step(20)
    repeated = client.read_input_registers(100, count=125).registers
    assert repeated[:5] + repeated[9:] == block[:5] + block[9:]


def test_a_plain_client_writes_the_start_of_the_block_and_reads_it_in_one_exchange(lvdt):
    client, _, _ = lvdt
    start = client.convert_to_registers(4010, client.DATATYPE.UINT32)
    block = client.readwrite_registers(read_address=100, read_count=125, write_address=0, values=start).registers
    assert number(client, block[1:3], "UINT32") == 4010
    assert block == client.read_holding_registers(100, count=125).registers
    assert block == client.read_input_registers(100, count=125).registers
    refused = client.readwrite_registers(read_address=100, read_count=125, write_address=500, values=[1])
    assert refused.exception_code == 2


def test_missing_registers_and_functions_are_refused_with_the_right_code(lvdt):
    client, _, _ = lvdt
    assert client.read_input_registers(60, count=2).exception_code == 2
    assert client.read_holding_registers(8, count=2).exception_code == 2
    assert client.write_register(0, 1).exception_code == 2  # half a number
    assert client.write_register(500, 1).exception_code == 2
    assert client.read_coils(0, count=1).exception_code == 1
    assert client.diag_query_data(b"\x12\x34").message == b"\x12\x34"


def test_every_injected_exception_reaches_a_plain_client(lvdt):
    client, server, _ = lvdt
    server.inject(ReplyFault("exception", 6))
    assert client.read_input_registers(0, count=1).exception_code == 6
    assert client.read_input_registers(0, count=1).registers == [0x4C56]


def test_a_request_to_another_unit_has_no_reply(lvdt):
    client, server, _ = lvdt
    client.comm_params.timeout_connect = 0.05
    with pytest.raises(Exception, match="No response"):
        client.read_input_registers(0, count=1, device_id=9)
    assert server.reply_count == 0


def test_a_plain_client_drives_the_coil():
    signals = FakeSignals()
    with serve(CoilAmplifierDevice(signals), "tcp") as (server, _):
        client = make_client(server)
        assert client.write_register(3, 0).isError()  # half a number
        setpoint = client.convert_to_registers(1_500_000, client.DATATYPE.INT32)
        assert client.write_registers(3, setpoint).exception_code == 4  # no mode yet
        assert client.write_register(2, 2).exception_code == 3  # this rig drives by voltage
        assert not client.write_register(2, 1).isError()
        assert not client.write_registers(3, setpoint).isError()
        signals.step(100)
        assert number(client, client.read_input_registers(15, count=2).registers, "INT32") == 1_500_000
        assert client.read_input_registers(13, count=2).registers == [0, 1]
        assert client.write_registers(3, [0x7FFF, 0xFFFF]).exception_code == 3
        client.close()
    assert signals.drive == 1.5


def test_a_plain_client_reads_the_temperature():
    with serve(SensorDevice("thermometer", FakeSignals()), "rtu over pty") as (server, _):
        client = make_client(server)
        client.connect()
        assert client.read_input_registers(8, count=1).registers == [2700]
        client.close()


def test_pipelined_requests_are_answered_in_order_with_their_own_numbers():
    with serve(SensorDevice("lvdt", FakeSignals()), "tcp") as (server, _):
        server.inject(ReplyFault("delay", 0.05))
        with socket.create_connection(("127.0.0.1", int(server.address.rpartition(":")[2])), 5) as plain:
            for tid, (address, count) in enumerate([(0, 1), (2, 2), (4, 2)], 41):
                plain.sendall(struct.pack(">HHHBBHH", tid, 0, 6, 1, 4, address, count))
            received = b""
            while len(received) < 11 + 13 + 13:
                received += plain.recv(4096)
    assert received == (
        bytes.fromhex("0029 0000 0005 01 04 02 4c56")
        + bytes.fromhex("002a 0000 0007 01 04 04 000003e8")
        + bytes.fromhex("002b 0000 0007 01 04 04 00001388")
    )

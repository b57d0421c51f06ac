"""The simulated rig as a process: plain clients use every wire in its bench.toml."""

import binascii
import itertools
import json
import signal
import struct
import subprocess
import sys
import time
import tomllib
from contextlib import contextmanager
from pathlib import Path

import canopen
import pytest
import serial
from pymodbus.client import ModbusSerialClient, ModbusTcpClient

pytestmark = pytest.mark.timeout(120)
EDS = Path(__file__).parents[2] / "drivers" / "wire" / "actuator.eds"
DEADLINE = 60.0
START, TARE = 1, 3


def start_rig(*arguments):
    return subprocess.Popen(
        [sys.executable, "-m", "sim_rig", "serve", *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@contextmanager
def running(folder, *arguments):
    """Run the rig as a process; yield its wires, its output and the process, and stop it at the end."""
    process = start_rig("--out", folder / "bench.toml", *arguments)
    try:
        output = []
        while process.stdout and (line := process.stdout.readline()):
            output.append(line)
            if "Ctrl-C" in line:
                break
        assert output, process.communicate(timeout=DEADLINE)[1]
        yield tomllib.loads((folder / "bench.toml").read_text())["instruments"], output, process
    finally:
        process.kill()
        process.communicate(timeout=DEADLINE)


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    with running(tmp_path_factory.mktemp("sim"), "--scenario", "default") as rig:
        yield rig


@contextmanager
def modbus(section):
    url = section["url"]
    if url.startswith("/dev/"):
        client = ModbusSerialClient(url, baudrate=section["baud"], timeout=5, retries=0)
    else:
        host, port = url.removeprefix("tcp://").split(":")
        client = ModbusTcpClient(host, port=int(port), timeout=5, retries=0)
    try:
        assert client.connect()
        yield client
    finally:
        client.close()


def number(client, section, address, type_):
    registers = client.read_input_registers(
        address, count=2 if "32" in type_ else 1, device_id=section["unit"]
    ).registers
    return client.convert_from_registers(registers, getattr(client.DATATYPE, type_))


def wait_until(condition, timeout=20.0):
    end = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.005)


def test_it_prints_the_address_of_every_instrument(rig):
    wires, output, _ = rig
    assert set(wires) == {"actuator", "load_cell", "lvdt", "coil_amplifier", "thermometer"}
    for name, section in wires.items():
        assert section["driver"] == name
        address = section.get("url") or str(section["port"])
        assert any(name in line and address in line for line in output)


def test_a_plain_modbus_client_reads_the_lvdt(rig):
    section = rig[0]["lvdt"]
    with modbus(section) as client:
        assert number(client, section, 0, "UINT16") == 0x4C56
        assert abs(number(client, section, 8, "INT32") * 1e-7) < 2e-4
        before = number(client, section, 4, "UINT32")
        wait_until(lambda: number(client, section, 4, "UINT32") > before + 100)


def test_a_plain_modbus_client_reads_the_room_from_the_thermometer(rig):
    section = rig[0]["thermometer"]
    with modbus(section) as client:
        wait_until(lambda: 20.0 < number(client, section, 8, "INT16") * 0.01 < 25.0)


def test_a_plain_modbus_client_drives_the_coil_and_measures_there(rig):
    section = rig[0]["coil_amplifier"]
    with modbus(section) as client:
        client.write_register(2, 1, device_id=section["unit"])
        client.write_registers(3, [*divmod(300_000, 65536)], device_id=section["unit"])
        wait_until(lambda: abs(number(client, section, 8, "INT32") * 1e-4 - 0.3) < 0.02)
        wait_until(lambda: abs(number(client, section, 10, "INT16") * 1e-4 - 0.06) < 0.02)
        client.write_registers(3, [0, 0], device_id=section["unit"])
        wait_until(lambda: abs(number(client, section, 8, "INT32") * 1e-4) < 0.02)


def make_frame(kind, payload):
    covered = bytes([len(payload), kind]) + payload
    return b"\xa5\x5a" + covered + struct.pack("<H", binascii.crc_hqx(covered, 0xFFFF))


def find_frames(data):
    """Return type and payload of the good frames among bytes."""
    start, good = 0, []
    while (start := data.find(b"\xa5\x5a", start)) >= 0 and start + 6 <= len(data):
        end = start + 4 + data[start + 2]
        covered = data[start + 2 : end]
        if data[end : end + 2] == struct.pack("<H", binascii.crc_hqx(covered, 0xFFFF)):
            good.append((covered[1], covered[2:]))
        start += 2
    return good


def test_a_plain_serial_reader_receives_the_load_cell(rig):
    section = rig[0]["load_cell"]
    with serial.Serial(section["url"], section["baud"], timeout=5) as port:
        port.write(make_frame(0x10, struct.pack("<BBI", 7, START, 0)))
        found = find_frames(port.read(21 * 300))
    assert struct.pack("<BBBi", 7, START, 0, 1000) in [payload for kind, payload in found if kind == 0x11]
    samples = [struct.unpack("<HIiiB", payload) for kind, payload in found if kind == 0x01]
    assert [sample[0] for sample in samples] == list(range(len(samples)))
    assert len(samples) > 250
    assert all(abs(sample[2] / 800 + 16.0) < 40.0 for sample in samples)
    micros = [later[1] - earlier[1] for earlier, later in itertools.pairwise(samples)]
    assert all(abs(step % 2**32 - 1000) <= 1 for step in micros)


def test_a_plain_canopen_node_reads_the_drive(rig):
    section = rig[0]["actuator"]
    network = canopen.Network()
    network.NOTIFIER_CYCLE = 0.05
    keys = ("interface", "channel", "host", "port")
    network.connect(**{key: section[key] for key in keys})
    try:
        node = network.add_node(section["node"], str(EDS))
        node.sdo.RESPONSE_TIMEOUT = 5.0
        statusword = node.sdo[0x6041].raw
        assert statusword & 0x4F == 0x40
        assert statusword & 0x8000, "its encoder knows where it is"
        assert abs(node.sdo[0x6064].raw) < 100
        node.nmt.wait_for_heartbeat(5.0)
    finally:
        network.disconnect()


@pytest.mark.parametrize("number_", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_stops_it_cleanly_with_clients_connected(tmp_path, number_):
    with running(tmp_path, "--speed", "4", "--lvdt", "rtu", "--load-cell", "tcp") as (wires, _, process):
        host, port = wires["load_cell"]["url"].removeprefix("socket://").split(":")
        with serial.serial_for_url(f"socket://{host}:{port}"), modbus(wires["lvdt"]) as client:
            assert number(client, wires["lvdt"], 0, "UINT16") == 0x4C56
            process.send_signal(number_)
            _, stderr = process.communicate(timeout=DEADLINE)
    assert (process.returncode, stderr) == (0, "")


def test_an_indicator_can_replace_the_framed_stream(tmp_path):
    with running(tmp_path, "--load-cell", "ascii") as (wires, _, _process):
        section = wires["load_cell"]
        assert section["driver"] == "ascii_load_cell"
        with serial.Serial(section["url"], section["baud"], timeout=5) as port:
            port.read_until(b"\r\n")
            assert port.read_until(b"\r\n").decode("ascii").split(",")[1] == "GS"


def test_a_wire_can_have_faults(tmp_path):
    faults = {"thermometer": [{"kind": "closed", "duration": 1e6}]}
    (tmp_path / "faults.json").write_text(json.dumps(faults))
    with running(tmp_path, "--faults", tmp_path / "faults.json") as (wires, _, _process):
        with modbus(wires["lvdt"]) as client:
            assert number(client, wires["lvdt"], 0, "UINT16") == 0x4C56
        with pytest.raises(Exception, match=r"(?i)connection|no response"), modbus(wires["thermometer"]) as client:
            number(client, wires["thermometer"], 0, "UINT16")


FAULTS = '{"load_cell": [{"kind": "delayed", "duration": 1}]}'


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--scenario", "nowhere"), "no scenario nowhere: neither a file nor one of"),
        (("--out", "no/such/place/bench.toml"), "bench.toml: cannot be written"),
        (("--faults", "none.json"), "none.json: cannot be read"),
        (("--faults", "faults.json"), "wire faults for load_cell: no instrument of that name"),
    ],
)
def test_an_error_exits_1_with_one_line(tmp_path, monkeypatch, arguments, message):
    monkeypatch.setenv("PYTHONPATH", str(EDS.parents[2]))
    monkeypatch.chdir(tmp_path)
    Path("faults.json").write_text(FAULTS)
    process = start_rig(*arguments)
    _, stderr = process.communicate(timeout=DEADLINE)
    assert process.returncode == 1
    assert message in stderr
    assert stderr.count("\n") == 1

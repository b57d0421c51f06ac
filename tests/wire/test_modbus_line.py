"""Modbus line: every failure is a typed error in time, and no request gets another one's reply."""

import random
import threading
import time

import pytest
from pymodbus import FramerType
from pymodbus.client import ModbusTcpClient

from drivers.errors import DriverError, InvalidReplyError, NoReplyError, NotConnectedError, RefusedError
from drivers.transport.modbus_address import ModbusAddress
from drivers.transport.modbus_line import ModbusLine
from sim_rig.protocols import modbus_requests
from sim_rig.protocols.modbus_requests import ModbusRequestError
from sim_rig.protocols.modbus_server import ReplyFault
from tests.support.modbus_bench import TIMEOUT, WIRES, serve, wait_until

pytestmark = pytest.mark.timeout(60)


class Echo:
    """Device whose registers contain their own addresses, so that a reply shows its request."""

    def __init__(self):
        self.written = []

    def read(self, function, address, count):
        if address + count > 60000:
            raise ModbusRequestError(2)
        return list(range(address, address + count))

    def write(self, address, words):
        self.written.append((address, words))

    def advance(self):
        pass


@pytest.fixture(params=WIRES)
def wire(request):
    """Return an open line, its server and its device."""
    device = Echo()
    with serve(device, request.param) as (server, address):
        line = ModbusLine("echo", address, 1, time.monotonic_ns, TIMEOUT)
        line.open()
        yield line, server, device
        line.close()


def test_reads_and_writes(wire):
    line, _, device = wire
    assert line.read("input", 7, 125).words == list(range(7, 132))
    assert line.read("holding", 40000, 1).words == [40000]
    line.write(5, [9])
    line.write(6, [1, 2, 3])
    assert device.written == [(5, [9]), (6, [1, 2, 3])]


FAULTS = [
    (ReplyFault("drop"), NoReplyError),
    (ReplyFault("delay", 3 * TIMEOUT), NoReplyError),
    (ReplyFault("crc"), (InvalidReplyError, NoReplyError)),
    (ReplyFault("truncate"), (InvalidReplyError, NoReplyError)),
    (ReplyFault("unit"), (InvalidReplyError, NoReplyError)),
    (ReplyFault("exception", 6), RefusedError),
]


@pytest.mark.parametrize(("fault", "error"), FAULTS, ids=lambda value: getattr(value, "kind", ""))
def test_a_failure_is_a_typed_error_and_the_next_reply_is_right(wire, fault, error):
    line, server, _ = wire
    server.inject(fault, function=4)
    with pytest.raises(error, match="echo: reading 10 registers at 100"):
        line.read("input", 100, 10)
    wait_until(lambda: _reads(line, 200) == list(range(200, 210)))


@pytest.mark.parametrize("fault", [ReplyFault("crc"), ReplyFault("truncate")], ids=lambda fault: fault.kind)
def test_a_broken_reply_is_counted(wire, fault):
    line, server, _ = wire
    server.inject(fault, function=4)
    with pytest.raises(InvalidReplyError, match="not a complete reply"):
        line.read("input", 100, 10)
    assert line.corrupted == 1


def _reads(line, address):
    try:
        return line.read("input", address, 10).words
    except DriverError:
        return None


def test_noise_before_a_reply_gives_the_reply_or_an_error(wire):
    line, server, _ = wire
    server.inject(ReplyFault("garbage"), function=4)
    assert _reads(line, 100) in (None, list(range(100, 110)))
    wait_until(lambda: _reads(line, 200) == list(range(200, 210)))


def test_no_request_gets_the_reply_to_another(wire):
    line, server, _ = wire
    chance = random.Random(7)
    kinds = ["delay", "delay", "delay", "drop", "crc", "truncate", "unit", "garbage"]
    right = 0
    for address in range(0, 4000, 100):
        if chance.random() < 0.6:
            server.inject(ReplyFault(chance.choice(kinds), chance.uniform(0.5, 2.2) * TIMEOUT))
        words = _reads(line, address)
        assert words in (None, list(range(address, address + 10)))
        right += words is not None
    assert right >= 10


def test_a_plain_client_takes_a_late_reply_for_the_next_one():
    """A line without synchronisation has this hazard, and the simulated instrument reproduces it."""
    with serve(Echo(), "rtu over socket") as (server, _):
        port = int(server.address.rpartition(":")[2])
        client = ModbusTcpClient("127.0.0.1", port=port, framer=FramerType.RTU, timeout=TIMEOUT, retries=0)
        client.connect()
        server.inject(ReplyFault("delay", 1.5 * TIMEOUT))
        with pytest.raises(Exception, match="No response"):
            client.read_input_registers(100, count=3)
        assert client.read_input_registers(200, count=3).registers == [100, 101, 102]
        client.close()


def test_a_long_silence_neither_hangs_nor_closes_the_line(wire):
    line, server, _ = wire
    line.read("input", 0, 1)
    server.silent = True
    for _ in range(8):
        with pytest.raises(NoReplyError, match="switched on"):
            line.read("input", 0, 1)
    server.silent = False
    wait_until(lambda: _reads(line, 300) == list(range(300, 310)))
    assert line.resynchronised >= 1


def test_a_refusal_has_a_reason(wire):
    line, _, _ = wire
    with pytest.raises(RefusedError, match=r"the register does not exist \(2\)"):
        line.read("input", 65000, 2)


def test_a_broken_connection_is_opened_again():
    with serve(Echo(), "tcp") as (server, address):
        line = ModbusLine("echo", address, 1, time.monotonic_ns, TIMEOUT)
        line.open()
        line.read("input", 0, 1)
        server.hang_up()
        wait_until(lambda: _reads(line, 500) == list(range(500, 510)))
        line.close()


def test_a_server_that_is_gone_is_not_connected():
    with serve(Echo(), "tcp") as (_, address):
        line = ModbusLine("echo", address, 1, time.monotonic_ns, TIMEOUT)
        line.open()
    with pytest.raises(NotConnectedError, match=r"echo: .*127\.0\.0\.1"):
        line.read("input", 0, 1)
    assert not line.connected
    line.close()


@pytest.mark.parametrize("url", ["tcp://127.0.0.1:1", "socket://127.0.0.1:1", "/dev/no_such_port"])
def test_a_missing_wire_cannot_be_opened(url):
    line = ModbusLine("echo", ModbusAddress(url, 115200), 1, time.monotonic_ns, TIMEOUT)
    with pytest.raises(NotConnectedError, match=f"echo: {url} cannot be opened"):
        line.open()


def test_a_closed_line_sends_nothing(wire):
    line, _, _ = wire
    line.close()
    line.close()
    with pytest.raises(NotConnectedError, match="connect first"):
        line.read("input", 0, 1)


def test_a_listener_gets_both_directions(wire):
    line, _, _ = wire
    frames = []
    line.add_listener(frames.append)
    line.read("input", 0, 100)
    assert [frame.sent for frame in frames] == [True, False]
    assert len(frames[1].data) > 200
    assert frames[0].received_ns <= frames[1].received_ns


def test_several_threads_get_their_own_replies(wire):
    line, _, _ = wire
    wrong = []

    def request(base):
        for address in range(base, base + 20):
            if line.read("input", address, 5).words != list(range(address, address + 5)):
                wrong.append(address)

    threads = [threading.Thread(target=request, args=(base,)) for base in (0, 1000, 2000)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(30)
    assert not wrong
    assert not any(thread.is_alive() for thread in threads)


def test_an_instrument_without_the_echo_function_is_synchronised_too(monkeypatch):
    execute = modbus_requests._execute

    def execute_without_echo(device, function, body):
        if function == 8:
            raise ModbusRequestError(1)
        return execute(device, function, body)

    monkeypatch.setattr(modbus_requests, "_execute", execute_without_echo)
    with serve(Echo(), "rtu over pty") as (server, address):
        line = ModbusLine("echo", address, 1, time.monotonic_ns, TIMEOUT)
        line.open()
        server.inject(ReplyFault("delay", 1.5 * TIMEOUT), function=4)
        assert _reads(line, 100) is None
        for base in range(200, 1000, 100):
            assert _reads(line, base) in (None, list(range(base, base + 10)))
        wait_until(lambda: _reads(line, 2000) == list(range(2000, 2010)))
        line.close()

"""The line alone: whatever goes wrong ends in a typed error in time, and never in another request's answer."""

import random
import threading
import time

import pytest
from modbus_bench import TIMEOUT, WIRES, served, until
from pymodbus import FramerType
from pymodbus.client import ModbusTcpClient

from drivers.errors import BadReply, DriverError, NoReply, NotConnected, Refused
from drivers.modbus_address import ModbusAddress
from drivers.modbus_line import ModbusLine
from sim_rig import modbus_requests
from sim_rig.modbus_requests import Illegal
from sim_rig.modbus_server import WireFault

pytestmark = pytest.mark.timeout(60)


class Echo:
    """Every register holds its own address, so that an answer shows which request it belongs to."""

    def __init__(self):
        self.written = []

    def read(self, function, address, count):
        if address + count > 60000:
            raise Illegal(2)
        return list(range(address, address + count))

    def write(self, address, words):
        self.written.append((address, words))

    def advance(self):
        pass


@pytest.fixture(params=WIRES)
def wire(request):
    """The line open, its server, and its device."""
    device = Echo()
    with served(device, request.param) as (server, address):
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
    (WireFault("drop"), NoReply),
    (WireFault("delay", 3 * TIMEOUT), NoReply),
    (WireFault("crc"), (BadReply, NoReply)),
    (WireFault("truncate"), (BadReply, NoReply)),
    (WireFault("unit"), (BadReply, NoReply)),
    (WireFault("exception", 6), Refused),
]


@pytest.mark.parametrize(("fault", "error"), FAULTS, ids=lambda value: getattr(value, "kind", ""))
def test_a_failure_is_a_typed_error_and_the_next_answer_is_right(wire, fault, error):
    line, server, _ = wire
    server.inject(fault, function=4)
    with pytest.raises(error, match="echo: reading 10 registers at 100"):
        line.read("input", 100, 10)
    until(lambda: _reads(line, 200) == list(range(200, 210)))


@pytest.mark.parametrize("fault", [WireFault("crc"), WireFault("truncate")], ids=lambda fault: fault.kind)
def test_a_broken_answer_is_counted(wire, fault):
    line, server, _ = wire
    server.inject(fault, function=4)
    with pytest.raises(BadReply, match="no whole answer"):
        line.read("input", 100, 10)
    assert line.corrupted == 1


def _reads(line, address):
    try:
        return line.read("input", address, 10).words
    except DriverError:
        return None


def test_noise_before_an_answer_gives_the_answer_or_an_error(wire):
    line, server, _ = wire
    server.inject(WireFault("garbage"), function=4)
    assert _reads(line, 100) in (None, list(range(100, 110)))
    until(lambda: _reads(line, 200) == list(range(200, 210)))


def test_no_request_ever_gets_the_answer_to_another_one(wire):
    line, server, _ = wire
    chance = random.Random(7)
    kinds = ["delay", "delay", "delay", "drop", "crc", "truncate", "unit", "garbage"]
    right = 0
    for address in range(0, 4000, 100):
        if chance.random() < 0.6:
            server.inject(WireFault(chance.choice(kinds), chance.uniform(0.5, 2.2) * TIMEOUT))
        words = _reads(line, address)
        assert words in (None, list(range(address, address + 10)))
        right += words is not None
    assert right >= 10


def test_a_plain_client_does_take_a_late_answer_for_the_next_one():
    """The trap is real, and the simulated instrument sets it."""
    with served(Echo(), "rtu over socket") as (server, _):
        port = int(server.address.rpartition(":")[2])
        client = ModbusTcpClient("127.0.0.1", port=port, framer=FramerType.RTU, timeout=TIMEOUT, retries=0)
        client.connect()
        server.inject(WireFault("delay", 1.5 * TIMEOUT))
        with pytest.raises(Exception, match="No response"):
            client.read_input_registers(100, count=3)
        assert client.read_input_registers(200, count=3).registers == [100, 101, 102]
        client.close()


def test_a_long_silence_does_not_hang_and_does_not_close_the_line_for_good(wire):
    line, server, _ = wire
    line.read("input", 0, 1)
    server.silent = True
    for _ in range(8):
        with pytest.raises(NoReply, match="switched on"):
            line.read("input", 0, 1)
    server.silent = False
    until(lambda: _reads(line, 300) == list(range(300, 310)))
    assert line.resynchronised >= 1


def test_a_refusal_says_why(wire):
    line, _, _ = wire
    with pytest.raises(Refused, match=r"there is no such register \(2\)"):
        line.read("input", 65000, 2)


def test_a_cut_connection_is_opened_again():
    with served(Echo(), "tcp") as (server, address):
        line = ModbusLine("echo", address, 1, time.monotonic_ns, TIMEOUT)
        line.open()
        line.read("input", 0, 1)
        server.hang_up()
        until(lambda: _reads(line, 500) == list(range(500, 510)))
        line.close()


def test_a_server_that_has_gone_is_not_connected():
    with served(Echo(), "tcp") as (_, address):
        line = ModbusLine("echo", address, 1, time.monotonic_ns, TIMEOUT)
        line.open()
    with pytest.raises(NotConnected, match=r"echo: .*127\.0\.0\.1"):
        line.read("input", 0, 1)
    assert not line.connected
    line.close()


@pytest.mark.parametrize("url", ["tcp://127.0.0.1:1", "socket://127.0.0.1:1", "/dev/no_such_port"])
def test_a_wire_that_is_not_there_cannot_be_opened(url):
    line = ModbusLine("echo", ModbusAddress(url, 115200), 1, time.monotonic_ns, TIMEOUT)
    with pytest.raises(NotConnected, match=f"echo: {url} cannot be opened"):
        line.open()


def test_nothing_is_asked_before_it_is_opened_or_after_it_is_closed(wire):
    line, _, _ = wire
    line.close()
    line.close()
    with pytest.raises(NotConnected, match="connect first"):
        line.read("input", 0, 1)


def test_the_tap_hears_both_directions(wire):
    line, _, _ = wire
    frames = []
    line.listen(frames.append)
    line.read("input", 0, 100)
    assert [frame.sent for frame in frames] == [True, False]
    assert len(frames[1].data) > 200
    assert frames[0].received_ns <= frames[1].received_ns


def test_several_threads_get_their_own_answers(wire):
    line, _, _ = wire
    wrong = []

    def ask(base):
        for address in range(base, base + 20):
            if line.read("input", address, 5).words != list(range(address, address + 5)):
                wrong.append(address)

    threads = [threading.Thread(target=ask, args=(base,)) for base in (0, 1000, 2000)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(30)
    assert not wrong
    assert not any(thread.is_alive() for thread in threads)


def test_an_instrument_without_the_echo_function_is_found_again_too(monkeypatch):
    known = modbus_requests._content

    def content(device, function, body):
        if function == 8:
            raise Illegal(1)
        return known(device, function, body)

    monkeypatch.setattr(modbus_requests, "_content", content)
    with served(Echo(), "rtu over pty") as (server, address):
        line = ModbusLine("echo", address, 1, time.monotonic_ns, TIMEOUT)
        line.open()
        server.inject(WireFault("delay", 1.5 * TIMEOUT), function=4)
        assert _reads(line, 100) is None
        for base in range(200, 1000, 100):
            assert _reads(line, base) in (None, list(range(base, base + 10)))
        until(lambda: _reads(line, 2000) == list(range(2000, 2010)))
        line.close()

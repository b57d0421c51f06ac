"""The proxy that applies faults to a TCP connection, in front of a server that echoes."""

import socket
import threading

import pytest

from sim_rig.errors import ScenarioError
from sim_rig.live.clock import SteppedClock
from sim_rig.protocols.fault_proxy import FaultProxy, WireFault, load_wire_faults

pytestmark = pytest.mark.timeout(60)
SECOND = 1_000_000_000


class Echo:
    """Device that returns all bytes to any number of hosts."""

    def __init__(self) -> None:
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.received = b""
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self) -> None:
        while True:
            try:
                connection, _ = self.listener.accept()
            except OSError:
                return
            threading.Thread(target=self._echo, args=(connection,), daemon=True).start()

    def _echo(self, connection: socket.socket) -> None:
        with connection:
            while data := connection.recv(4096):
                self.received += data
                connection.sendall(data)


@pytest.fixture
def echo():
    echo = Echo()
    yield echo
    echo.listener.close()


@pytest.fixture
def bench(echo):
    """Return a clock, a proxy in front of the device, and a function that connects to it."""
    clock, hosts = SteppedClock(), []
    with FaultProxy(echo.listener.getsockname(), clock) as proxy:

        def connect() -> socket.socket:
            hosts.append(socket.create_connection((proxy.host, proxy.port), 10.0))
            return hosts[-1]

        yield clock, proxy, connect
    for host in hosts:
        host.close()


def receive(host: socket.socket, count: int) -> bytes:
    data = b""
    while len(data) < count and (piece := host.recv(count - len(data))):
        data += piece
    return data


def is_silent(host: socket.socket) -> bool:
    host.settimeout(0.1)
    try:
        return not host.recv(1) and False
    except TimeoutError:
        return True
    finally:
        host.settimeout(10.0)


def test_without_faults_everything_passes(bench):
    host = bench[2]()
    host.sendall(bytes(range(256)) * 100)
    assert receive(host, 25600) == bytes(range(256)) * 100


def test_delayed_bytes_arrive_later_by_the_clock(bench):
    clock, proxy, connect = bench
    host = connect()
    proxy.inject(WireFault(kind="delayed", delay=0.5, duration=10.0))
    host.sendall(b"late")
    assert is_silent(host)
    clock.advance(SECOND)
    assert receive(host, 4) == b"late"


def test_the_second_half_of_a_truncated_piece_is_lost(bench, echo):
    _, proxy, connect = bench
    host = connect()
    proxy.inject(WireFault(kind="truncated", duration=1.0, direction="to_device"))
    host.sendall(b"12345678")
    assert receive(host, 4) == b"1234"
    assert echo.received == b"1234"


def test_one_bit_of_a_corrupted_piece_is_flipped(bench, echo):
    _, proxy, connect = bench
    host = connect()
    proxy.inject(WireFault(kind="corrupted", duration=1.0))
    host.sendall(b"12345678")
    corrupted = receive(host, 8)
    flipped = [one ^ other for one, other in zip(corrupted, b"12345678", strict=True)]
    assert sum(bits.bit_count() for bits in flipped) == 1
    assert echo.received == b"12345678"


def test_a_stalled_wire_passes_nothing_and_then_all_at_once(bench):
    clock, proxy, connect = bench
    host = connect()
    proxy.inject(WireFault(kind="stalled", duration=1.0))
    host.sendall(b"one")
    assert is_silent(host)
    host.sendall(b"two")
    clock.advance(SECOND)
    assert receive(host, 6) == b"onetwo"


def test_a_closed_wire_ends_the_connection_and_accepts_none_until_it_is_over(bench):
    clock, proxy, connect = bench
    before = connect()
    before.sendall(b"x")
    assert receive(before, 1) == b"x"
    proxy.inject(WireFault(kind="closed", duration=1.0))
    assert before.recv(1) == b""
    assert connect().recv(1) == b""
    clock.advance(SECOND)
    after = connect()
    after.sendall(b"again")
    assert receive(after, 5) == b"again"


def test_a_fault_begins_and_ends_as_scheduled(bench):
    clock, proxy, connect = bench
    host = connect()
    proxy.inject(WireFault(kind="truncated", start=1.0, duration=1.0))
    for expected in (b"12", b"1", b"12"):
        host.sendall(b"12")
        assert receive(host, len(expected)) == expected
        clock.advance(SECOND)


def test_bytes_sent_before_the_device_closes_still_pass():
    device, clock = socket.create_server(("127.0.0.1", 0)), SteppedClock()
    with (
        device,
        FaultProxy(device.getsockname(), clock) as proxy,
        socket.create_connection((proxy.host, proxy.port), 10.0) as host,
    ):
        connection, _ = device.accept()
        connection.sendall(b"last words")
        connection.close()
        assert receive(host, 100) == b"last words"


def test_without_a_device_the_connection_ends():
    proxy = FaultProxy(("127.0.0.1", 1), SteppedClock())
    with proxy, socket.create_connection((proxy.host, proxy.port), 10.0) as host:
        assert host.recv(1) == b""


def test_faults_are_read_from_a_file_by_instrument(tmp_path):
    (tmp_path / "faults.json").write_text('{"lvdt": [{"kind": "delayed", "duration": 2, "delay": 0.1}]}')
    assert load_wire_faults(tmp_path / "faults.json") == {
        "lvdt": (WireFault(kind="delayed", duration=2.0, delay=0.1),)
    }


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"lvdt": [{"kind": "lost", "duration": 2}]}', "lvdt.0.kind: Input should be 'delayed'"),
        ('{"lvdt": [{"kind": "delayed"}]}', "lvdt.0.duration: is missing"),
        ("[]", "document: Input should be"),
    ],
)
def test_invalid_faults_are_refused(tmp_path, text, message):
    (tmp_path / "faults.json").write_text(text)
    with pytest.raises(ScenarioError, match=message):
        load_wire_faults(tmp_path / "faults.json")


def test_a_missing_file_of_faults_is_refused(tmp_path):
    with pytest.raises(ScenarioError, match=r"none\.json: cannot be read"):
        load_wire_faults(tmp_path / "none.json")

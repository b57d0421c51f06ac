import struct
import threading
import time
from binascii import crc_hqx

import numpy as np
import pytest
import serial

from drivers.errors import (
    DriverError,
    InvalidReplyError,
    NoReplyError,
    NotConnectedError,
    OutOfRangeError,
    RefusedError,
)
from drivers.load_cell.decoder import LoadCellDecoder
from drivers.load_cell.frames import CONTRACT
from drivers.load_cell.load_cell import LoadCell
from sim_rig.instruments.load_cell import encode_frame, make_load_cell
from sim_rig.live.device_clock import DeviceClock
from sim_rig.protocols.serial_port import SerialPort, drop, flip_bit, prepend_noise, truncate
from tests.support.serial_lines import (
    KnownForce,
    Rfc2217Server,
    collect,
    is_equal,
    join,
    moving,
    numbers,
    saw,
    still,
    wait_until,
)

SAMPLE = CONTRACT["frames"]["sample"]["type"]
TCP = "127.0.0.1:0"


@pytest.fixture
def rig():
    """Return a function that starts a load cell with a driver that is not connected; stop all at the end."""
    running, drivers = [], []

    def start(force=saw, address="pty", **options):
        adapter, device = make_load_cell(KnownForce(force), address, **options)
        adapter.start()
        running.append(adapter)
        drivers.append(LoadCell("load cell", adapter.address, time.monotonic_ns))
        return adapter, device, drivers[-1]

    yield start
    for driver in drivers:
        driver.close()
    for adapter in running:
        adapter.stop()


@pytest.fixture
def streaming(rig):
    """Return a function that starts a load cell with a connected driver."""

    def start(*arguments, **options):
        adapter, device, driver = rig(*arguments, **options)
        driver.connect()
        return adapter, device, driver

    return start


def is_right(blocks):
    """Return whether every value is the force at the time of its sample."""
    ticks = join(blocks, "device_ns") // 1_000_000
    return np.array_equal(join(blocks, "values"), saw(ticks))


@pytest.mark.parametrize("address", ["pty", TCP])
def test_every_sample_comes_once_with_its_time_and_value(streaming, address):
    _, _, driver = streaming(address=address)
    blocks = collect(driver, 600)
    assert is_right(blocks)
    assert np.array_equal(np.diff(numbers(blocks)), np.ones(len(numbers(blocks)) - 1))
    assert np.array_equal(np.diff(join(blocks, "device_ns")), np.full(len(numbers(blocks)) - 1, 1_000_000))
    assert {block.quality for block in blocks} == {"good"}
    health = driver.get_health()
    assert (health.connected, health.lost, health.corrupted, health.resynchronised) == (True, 0, 0, 0)


@pytest.mark.filterwarnings("ignore:set(Daemon|Name)")
def test_a_serial_server_in_between_changes_nothing(rig):
    adapter, _, _ = rig(address=TCP)
    with Rfc2217Server(adapter.address) as url:
        driver = LoadCell("load cell", url, time.monotonic_ns)
        driver.connect()
        blocks = collect(driver, 200)
        driver.close()
    assert is_right(blocks)
    assert driver.get_health().lost == 0


def test_the_instruments_own_clock_is_reported(streaming):
    clock = DeviceClock(offset_ns=5_000_000_000, ppm=200.0)
    _, _, driver = streaming(clock=clock)
    times = join(collect(driver, 200), "device_ns")
    ticks = np.rint((times - 5_000_000_000) / 1.0002e6).astype(int)
    assert all(
        abs(clock.read_ns(int(tick) * 1_000_000) - at) < 1000 for tick, at in zip(ticks, times, strict=True)
    )


def test_taring_keeps_the_untared_force(streaming):
    _, _, driver = streaming(still)
    collect(driver, 150)
    assert driver.tare() == pytest.approx(123.5)
    driver.acquire(0.0)
    tared = driver.acquire(1.0)
    assert {block.channel: block.values[-1] for block in tared} == {"force": 0.0, "force_raw": 123.5}
    driver.clear_tare()
    assert driver.read("force").value == driver.read("force_raw").value == 123.5


def test_taring_is_refused_while_the_force_moves(streaming):
    _, _, driver = streaming(moving)
    collect(driver, 150)
    with pytest.raises(RefusedError, match=r"load cell: tare .*not now.*hold the actuator still"):
        driver.tare()


def test_a_rate_is_set_and_kept_over_a_restart(streaming):
    _, _, driver = streaming()
    driver.set_rate(100)
    driver.acquire(0.0)
    times = join(collect(driver, 20), "device_ns")
    assert np.all(np.diff(times)[-15:] == 10_000_000)
    driver.stop()
    assert driver.get_health().message == "stopped"


def test_a_rate_that_is_not_offered_is_out_of_range(streaming):
    _, _, driver = streaming()
    with pytest.raises(OutOfRangeError, match=r"333 Hz is not one of the rates .* nothing was sent"):
        driver.set_rate(333)


@pytest.mark.parametrize(
    ("fault", "lost", "corrupted", "resynchronised"),
    [(truncate, 3, 3, 1), (flip_bit, 3, 3, 1), (drop, 3, 0, 0), (prepend_noise, 0, 0, 3)],
)
def test_a_faulty_stream_loses_only_its_faulty_frames(streaming, fault, lost, corrupted, resynchronised):
    adapter, _, driver = streaming()
    blocks = collect(driver, 50)
    faulty = []
    adapter.faults.inject(lambda frame: faulty.append(frame) or fault(frame), 3)
    wait_until(lambda: bool(blocks.extend(driver.acquire(0.05))) or not adapter.faults.pending_count, "the fault")
    blocks = [block for block in blocks if block.channel == "force"] + collect(driver, 50)
    lost -= bool(lost) * sum(frame[3] != SAMPLE for frame in faulty)  # a clock reply is not a sample
    health = driver.get_health()
    assert (health.lost, health.resynchronised) == (lost, resynchronised)
    assert health.corrupted >= corrupted
    assert is_right(blocks)
    assert np.sum(np.diff(numbers(blocks)) - 1) == lost


def test_silence_is_reported_and_its_samples_are_counted(streaming):
    adapter, _, driver = streaming()
    blocks = collect(driver, 20)
    adapter.faults.silent = True
    blocks += [b for b in driver.acquire(0.05) + driver.acquire(0.05) if b.channel == "force"]
    wait_until(lambda: not driver.acquire(0.05) and "silent for" in driver.get_health().message, "silence")
    adapter.faults.silent = False
    blocks += collect(driver, 20)
    steps = np.diff(join(blocks, "device_ns")) // 1_000_000
    assert driver.get_health().lost == np.sum(steps - 1) > 0
    assert driver.get_health().message == ""
    assert np.array_equal(np.diff(numbers(blocks)), steps)


def test_a_forward_jump_of_the_sequence_is_a_loss_and_a_backward_one_a_restart(streaming):
    _, device, driver = streaming()
    collect(driver, 20)
    device.skip_samples(7)
    collect(driver, 50)
    assert driver.get_health().lost == 7
    device.skip_samples(-30)
    assert is_right(collect(driver, 50))
    assert (driver.get_health().lost, driver.get_health().resynchronised) == (7, 1)


def test_a_silent_instrument_is_no_reply(rig):
    adapter, _, driver = rig()
    adapter.faults.silent = True
    with pytest.raises(NoReplyError, match=r"load cell: stop received no reply within 0\.5 s, sent 3 times"):
        driver.connect()
    assert not driver.get_health().connected


@pytest.mark.parametrize("fault", [truncate, flip_bit, drop, prepend_noise])
def test_a_faulty_reply_is_requested_again(rig, fault):
    adapter, _, driver = rig()
    adapter.faults.inject(fault)
    driver.connect()
    assert is_right(collect(driver, 50))


def test_a_late_reply_is_not_taken_for_another(streaming):
    adapter, _, driver = streaming(still)
    collect(driver, 150)
    driver.stop()
    stale = encode_frame("acknowledgement", 200, 3, 0, 99999)
    adapter.faults.inject(lambda frame: stale + frame)
    assert driver.tare() == pytest.approx(123.5)


@pytest.mark.parametrize(
    ("reply", "message"),
    [
        (encode_frame("identity", 1, 6, 1, 7, 400), "counts_per_newton 400, expected 800"),
        (encode_frame("identity", 1, 6, 9, 7, 800), "protocol 9, expected 1"),
        (encode_frame("acknowledgement", 1, 6, 0, 0), "identify received the reply Acknowledgement"),
    ],
)
def test_another_instrument_is_an_invalid_reply(rig, reply, message):
    adapter, _, driver = rig()
    adapter.faults.inject(lambda frame: frame)
    adapter.faults.inject(lambda _: reply)
    with pytest.raises(InvalidReplyError, match=message):
        driver.connect()


def test_a_rate_that_the_instrument_does_not_adopt_is_an_invalid_reply(streaming):
    adapter, _, driver = streaming()
    driver.stop()
    driver.acquire(0.0)
    adapter.faults.inject(lambda frame: encode_frame("acknowledgement", frame[4], 5, 0, 10))
    with pytest.raises(InvalidReplyError, match="set_rate gave 10 Hz, not 100 Hz"):
        driver.set_rate(100)


def test_an_identity_instead_of_an_acknowledgement_is_an_invalid_reply(streaming):
    adapter, _, driver = streaming()
    driver.stop()
    adapter.faults.inject(lambda frame: encode_frame("identity", frame[4], 4, 1, 7, 800))
    with pytest.raises(InvalidReplyError, match="clear_tare received the reply Identity"):
        driver.clear_tare()


def test_a_pulled_cable_is_reported_and_the_driver_connects_again(streaming):
    adapter, _, driver = streaming(address=TCP)
    collect(driver, 20)
    adapter.hang_up()
    with pytest.raises(NotConnectedError, match="is gone"):
        wait_until(lambda: driver.acquire(0.05) is None, "the end of the line")
    assert driver.get_health().message == "not connected"
    driver.connect()
    assert is_right(collect(driver, 50))
    assert driver.get_health().lost == 0


def test_a_vanished_terminal_is_reported(streaming):
    adapter, _, driver = streaming()
    adapter.stop()
    with pytest.raises(NotConnectedError):
        wait_until(lambda: driver.acquire(0.05) is None, "the end of the line")
    with pytest.raises(NotConnectedError, match="is not open; connect first"):
        driver.tare()
    driver.make_safe()
    driver.close()


@pytest.mark.parametrize("port", ["/dev/no_such_port", "socket://127.0.0.1:1", "wrong://x"])
def test_a_port_that_does_not_open_is_not_connected(port):
    driver = LoadCell("load cell", port, time.monotonic_ns)
    with pytest.raises(NotConnectedError, match="cannot be opened"):
        driver.connect()
    with pytest.raises(NotConnectedError, match="connect first"):
        driver.acquire(0.0)
    driver.close()


def test_a_port_in_use_is_not_opened_twice(streaming):
    adapter, _, _ = streaming()
    with pytest.raises(NotConnectedError, match="no other program holds it"):
        LoadCell("load cell", adapter.address, time.monotonic_ns).connect()


def test_sensor_faults_make_bad_samples(streaming):
    _, device, driver = streaming()
    device.bridge_open = True
    wait_until(lambda: any(block.quality == "bad" for block in driver.acquire(0.05)), "bad samples")
    assert driver.get_health().message == "sensor fault"


def test_an_overloaded_cell_makes_bad_samples(streaming):
    _, _, driver = streaming(lambda ticks: np.full(len(ticks), 12000.0))
    assert {block.quality for block in collect(driver, 20)} == {"bad"}
    assert driver.get_health().message.startswith("overload")


def test_a_stuck_reading_is_reported(streaming):
    _, device, driver = streaming()
    device.stuck = True
    wait_until(lambda: bool(driver.acquire(0.05)) and "stuck" in driver.get_health().message, "a stuck reading")


def test_a_stopped_stream_has_no_reading(streaming):
    _, _, driver = streaming()
    driver.stop()
    driver.acquire(0.0)
    with pytest.raises(NoReplyError, match="no sample of force within"):
        driver.read("force")


def test_a_load_cell_has_no_writable_channel(streaming):
    _, _, driver = streaming()
    with pytest.raises(OutOfRangeError, match="force is measured and cannot be set to 1 N"):
        driver.write("force", 1.0)
    with pytest.raises(OutOfRangeError, match="no channel 'position', only force, force_raw"):
        driver.read("position")


def test_one_thread_acquires_while_another_tares(streaming):
    _, _, driver = streaming(still, TCP)
    blocks, errors, done = [], [], threading.Event()

    def acquire():
        try:
            while not done.is_set():
                blocks.extend(driver.acquire(0.1))
        except DriverError as error:
            errors.append(error)

    thread = threading.Thread(target=acquire)
    thread.start()
    wait_until(lambda: driver.read("force").value is not None and len(blocks) > 100, "samples")
    for _ in range(5):
        driver.tare()
        driver.clear_tare()
    done.set()
    thread.join()
    forces = [block for block in blocks if block.channel == "force"]
    assert not errors
    assert np.all(np.diff(numbers(forces)) == 1)
    assert driver.get_health().lost == 0


def test_replay_of_the_recorded_bytes_gives_the_same_blocks_bit_for_bit(rig):
    adapter, _, driver = rig(address=TCP)
    frames, live = [], []
    driver.add_listener(frames.append)
    for fault in (truncate, flip_bit, prepend_noise):
        driver.connect()
        adapter.faults.inject(fault, 2)
        wait_until(
            lambda: bool(live.extend(driver.acquire(0.05))) or not adapter.faults.pending_count, "the fault"
        )
        live.extend(driver.acquire(0.1))
        driver.close()
    decoder = LoadCellDecoder()
    replayed = {
        (block.channel, block.first): block
        for frame in frames
        if not frame.sent
        for block in decoder.feed(frame.received_ns, frame.data)
    }
    assert len(live) > 10
    assert all(is_equal(block, replayed[block.channel, block.first]) for block in live)


def test_a_plain_serial_reader_can_decode_the_instrument(rig):
    adapter, _, _ = rig()
    with serial.serial_for_url(adapter.address, 460800, timeout=1.0) as port:
        port.write(
            bytes.fromhex("a55a06102a0100000000") + struct.pack("<H", crc_hqx(b"\x06\x10\x2a\x01\0\0\0\0", 0xFFFF))
        )
        acknowledged = port.read(13)
        frames = [port.read(21) for _ in range(100)]
    assert acknowledged[:11] == bytes.fromhex("a55a07112a0100e8030000")
    assert all(struct.unpack("<H", frame[-2:])[0] == crc_hqx(frame[2:-2], 0xFFFF) for frame in frames)
    fields = [struct.unpack("<HIiiB", frame[4:-2]) for frame in frames]
    assert [sequence for sequence, *_ in fields] == list(range(100))
    assert all(counts == 800 * saw(np.array(at // 1000)) for _, at, counts, _, _ in fields)
    assert {tare for *_, tare, _ in fields} == {0}


def test_the_line_is_no_faster_than_its_baud_rate():
    port = SerialPort("pty", 9600, buffer=4096, batch=0.0)
    with serial.serial_for_url(port.address, 9600, timeout=0.2) as host:
        port.send(bytes(1000), 0)
        port.flush(100_000_000)
        assert len(host.read(1000)) == 95
        port.flush(1_041_670_000)
        assert len(host.read(1000)) == 905
    port.close()


def test_bytes_from_a_late_rig_do_not_overrun_the_instrument():
    port = SerialPort("pty", 460800, buffer=50, batch=0.0)
    with serial.serial_for_url(port.address, 460800, timeout=0.2) as host:
        for millisecond in range(100):
            port.send(bytes(21), millisecond * 1_000_000)
        port.flush(100_000_000)
        assert len(host.read(2100)) == 2100
    assert port.overruns == 0
    port.close()


def test_bytes_that_the_host_does_not_read_are_lost():
    port = SerialPort("pty", 460800, buffer=100_000, batch=0.0)
    with serial.serial_for_url(port.address, 460800, timeout=0.2) as host:
        port.send(bytes(90_000), 0)
        port.flush(10_000_000_000)
        assert port.unread_bytes == 90_000 - 65_536
        received = bytearray()

        def is_all_received():
            port.flush(20_000_000_000)
            received.extend(host.read(4096))
            return len(received) >= 65_536

        wait_until(is_all_received, "the end of the kept bytes")
    port.close()


def test_a_full_transmit_buffer_loses_whole_frames_and_batches_hold_bytes_back():
    port = SerialPort("pty", 460800, buffer=50, batch=0.01)
    with serial.serial_for_url(port.address, 460800, timeout=0.2) as host:
        for _ in range(3):
            port.send(bytes(21), 0)
        assert port.overruns == 1
        port.flush(5_000_000)
        assert host.in_waiting == 0
        port.flush(10_000_000)
        assert len(host.read(100)) == 42
    port.close()

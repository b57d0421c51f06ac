"""Times of a simulated serial line."""

import pytest

from sim_rig.protocols.serial_port import SerialPort


@pytest.fixture
def port():
    port = SerialPort("pty", baud=10_000, buffer=64, batch=0.5)
    yield port
    port.close()


def test_a_batch_waits_for_the_time_since_the_one_before(port):
    port.send(b"1234", 1_000_000_000)
    port.flush(1_010_000_000)
    assert port.compute_batch_wait(1_110_000_000) == pytest.approx(0.4)
    assert port.compute_batch_wait(2_000_000_000) == 0.0
    port.send(b"5678", 1_100_000_000)
    port.flush(1_200_000_000)
    assert port.compute_batch_wait(1_200_000_000) == pytest.approx(0.31)


def test_a_byte_takes_ten_bits_of_the_line(port):
    port.send(b"x" * 60, 0)
    port.send(b"y" * 5, 500_000)
    assert port.overruns == 1
    # After 1 ms the line has sent one byte of ten bits.
    port.send(b"y" * 5, 1_000_000)
    assert port.overruns == 1

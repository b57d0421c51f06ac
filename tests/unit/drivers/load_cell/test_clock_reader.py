"""Readings of the load cell's clock: times of requests, use of the replies, without a line."""

import math

import pytest

from drivers.channel import ClockReading
from drivers.load_cell.clock_reader import ClockReader
from drivers.load_cell.decoder import LoadCellDecoder
from drivers.load_cell.frames import CONTRACT, Acknowledgement, Request, Sample, encode_frame

US, MS = 1_000, 1_000_000
BEGIN = 50_000 * MS
READ_CLOCK, START = CONTRACT["commands"]["read_clock"], CONTRACT["commands"]["start"]


class Bench:
    """Clock reader on a running stream whose latest sample arrived at the begin."""

    def __init__(self, baud=460_800, rate=1000):
        self.now, self.sent, self.tokens = BEGIN, [], 0
        self.decoder = LoadCellDecoder()
        if rate:
            self.decoder.feed(BEGIN, encode_frame(Acknowledgement(200, START, 0, rate)))
            self.decoder.feed(BEGIN, encode_frame(Sample(0, 1_000_000, 0, 0, 0)))
        self.reader = ClockReader(self.decoder, lambda: self.now, baud)

    def poll(self, now=None):
        """Poll at an instant [ns]; return whether a request was sent."""
        self.now = self.now if now is None else now
        before = len(self.sent)
        self.reader.poll(self.make_token, self.sent.append)
        return len(self.sent) > before

    def make_token(self):
        self.tokens = (self.tokens + 1) % 256
        return self.tokens

    def reply(self, at, value=2_000_000, command=READ_CLOCK, code=0):
        """Receive a reply to the latest request at an instant [ns], with nothing else on the line."""
        self.now = at
        self.decoder.feed(at, encode_frame(Acknowledgement(self.tokens, command, code, value)))

    def sample(self, at):
        """Receive a sample at an instant [ns]."""
        self.decoder.feed(
            at, encode_frame(Sample((at - BEGIN) // MS % 65536, 1_000_000 + (at - BEGIN) // US, 1, 0, 0))
        )

    def exchange(self, round_trip, value=2_000_000):
        """Poll until a request is sent, and receive its reply after a round trip [ns]; return the instant."""
        while not self.poll():
            self.now += 100 * US
        sent_ns = self.now
        self.reply(sent_ns + round_trip, value)
        return sent_ns


def test_a_reading_excludes_the_transfer_of_its_reply():
    """The reply has 13 bytes of 10 bits: 282118 ns at 460800 Bd."""
    bench = Bench()
    sent_ns = bench.exchange(5 * MS, 3_000_123)
    bench.poll()
    assert bench.sent[0] == encode_frame(Request(1, READ_CLOCK, 0))
    assert bench.reader.clock_reading == ClockReading(3_000_123_000, sent_ns, sent_ns + 5 * MS - 282_118)


def test_the_transfer_of_a_reply_does_not_exceed_the_round_trip():
    bench = Bench(baud=9600)  # 13.5 ms
    sent_ns = bench.exchange(5 * MS)
    bench.poll()
    assert bench.reader.clock_reading == ClockReading(2_000_000_000, sent_ns, sent_ns)


def test_no_request_without_a_stream():
    assert not Bench(rate=None).poll(BEGIN + 1000 * MS)


def test_the_first_request_explores_and_leaves_at_most_two_batches_late():
    bench = Bench()
    assert bench.reader.compute_wait() == 0.0
    assert bench.poll(BEGIN)


@pytest.mark.parametrize(("received", "wait"), [(0, 5.0), (3, 7.944_272), (20, 21.0)])
def test_the_next_request_leaves_when_due_and_at_most_two_batches_later(received, wait):
    """Due after 5 ms; at phase 0.618 x 8 ms after the latest frame; after 5 ms + 2 x 8 ms at the latest."""
    bench = Bench()
    bench.poll(BEGIN)
    bench.sample(BEGIN + received * MS)
    bench.now = BEGIN
    assert bench.reader.compute_wait() == pytest.approx(wait * 1e-3, abs=1e-9)


def test_a_request_waits_half_a_second_for_its_reply():
    bench = Bench()
    bench.poll(BEGIN)
    assert bench.reader.compute_idle_time() == 0.0
    assert not bench.poll(BEGIN + 500 * MS - 1)
    assert bench.poll(BEGIN + 500 * MS)


def test_requests_leave_at_the_phase_of_the_shortest_round_trip_except_those_that_explore():
    """The parts of 0.3 ms and of 8 ms are multiples of the golden ratio modulo 1: 0.618, 0.236, 0.854, 0.472."""
    bench, waits, begin = Bench(), [], BEGIN
    # Phase and round trip [ms]: the third replaces the first, because the best grew by 2 %; then two are shorter.
    for phase, round_trip in (
        (3.0, 1.0),
        (3.1, 3.0),
        (4.0, 1.01),
        (7.0, 2.0),
        (4.5, 0.5),
        (5.0, 0.4),
        (6.0, 0.9),
        (5.0, 1.0),
    ):
        bench.sample(begin)
        bench.now = begin
        waits.append(bench.reader.compute_wait() * 1e3)
        sent_ns = begin + round(phase * MS)
        assert bench.poll(sent_ns)
        bench.reply(sent_ns + round(round_trip * MS))
        bench.poll()
        begin = sent_ns + 10 * MS
    expected = [0.0, 3.035_410, 2.920_820, 6.832_816, 3.991_641, 4.377_051, 5.665_631, 4.947_871]
    assert waits == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize(("command", "code"), [(START, 0), (READ_CLOCK, 1)])
def test_a_reply_without_a_clock_is_not_a_reading(command, code):
    bench = Bench()
    bench.poll(BEGIN)
    bench.reply(BEGIN + 1 * MS, 1000, command, code)
    bench.poll()
    assert bench.reader.clock_reading is None


def test_a_load_cell_that_refuses_is_not_asked_again_until_it_is_connected_again():
    bench = Bench()
    bench.poll(BEGIN)
    bench.reply(BEGIN + 1 * MS, code=1)
    assert not bench.poll(BEGIN + 2000 * MS)
    assert bench.reader.compute_idle_time() == math.inf
    bench.reader.restart()
    assert bench.poll(BEGIN + 2001 * MS)


@pytest.mark.parametrize(("exchanges", "period"), [(63, 5), (64, 40), (255, 40), (256, 100)])
def test_requests_become_rarer(exchanges, period):
    bench = Bench()
    for _ in range(exchanges):
        sent_ns = bench.exchange(1 * MS)
    bench.poll()
    # Idle until one batch period before the request is due.
    bench.now = sent_ns
    assert bench.reader.compute_idle_time() == pytest.approx(max(period - 8, 0) * 1e-3)

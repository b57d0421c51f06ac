"""Load cell on a double of its line: requests, refusals, values in newtons and reported problems."""

import pytest

from drivers.channel import Frame
from drivers.errors import InvalidReplyError, NoReplyError, OutOfRangeError, RefusedError
from drivers.instrument import Health
from drivers.load_cell.ascii_load_cell import AsciiLoadCell
from drivers.load_cell.frames import CONTRACT, Acknowledgement, FrameDecoder, Identity, Sample, encode_frame
from drivers.load_cell.load_cell import LoadCell

MS = 1_000_000
NAMES = {code: name for name, code in CONTRACT["commands"].items()}


class Line:
    """Line to a load cell that replies to every request at once, as a table by command demands."""

    def __init__(self, *_):
        self.is_open, self.requests, self.pending, self.replies = False, [], b"", {}
        self.decoder, self.rate = FrameDecoder(), 1000

    def open(self):
        self.is_open = True

    def close(self):
        self.is_open = False

    def write(self, data):
        for request in self.decoder.feed(data):
            name = NAMES[request.command]
            self.requests.append((name, request.argument))
            self.rate = request.argument if name == "set_rate" else self.rate
            code, value = self.replies.get(name, (0, self.rate))
            if name == "identify":
                reply = Identity(request.token, request.command, 1, 5, self.replies.get(name, 800))
            else:
                reply = Acknowledgement(request.token, request.command, code, value)
            self.pending += b"" if code is None else encode_frame(reply)

    def read(self, timeout):
        data, self.pending = self.pending, b""
        return Frame(self.now, False, data) if data else None

    now = 0

    def send(self, *counts, status=0, first=0):
        """Let samples arrive, one per millisecond."""
        for number, count in enumerate(counts, first):
            self.pending += encode_frame(Sample(number, 1000 * number, count, 80, status))


@pytest.fixture
def cell(monkeypatch):
    """Return a load cell that is connected at 1 kHz, and not yet read."""
    monkeypatch.setattr("drivers.load_cell.load_cell.SerialLine", Line)
    cell = LoadCell("cell", "/dev/null", lambda: Line.now)
    cell.connect()
    return cell


def test_a_connection_stops_the_stream_checks_the_instrument_and_starts_at_the_rate(cell):
    assert cell._line.requests == [("stop", 0), ("identify", 0), ("set_rate", 1000), ("start", 0)]
    assert cell.get_health() == Health(True, 1, 0, 0, 0, 0, "")  # the reply to start


def test_forces_are_in_newtons_and_the_tared_range_is_doubled(cell):
    assert [(one.name, one.low, one.high) for one in cell.channels] == [
        ("force", -20_000.0, 20_000.0), ("force_raw", -10_000.0, 10_000.0)
    ]  # fmt: skip
    cell._line.send(8_000)
    blocks = {block.channel: block.values.tolist() for block in cell.acquire(0.0)}
    assert blocks == {"force": [9.9], "force_raw": [10.0]}


def test_the_tare_is_returned_in_newtons(cell):
    cell._line.replies["tare"] = 0, 10_000
    assert cell.tare() == 12.5


def test_a_refused_tare_names_its_reason(cell):
    cell._line.replies["tare"] = 3, 0
    with pytest.raises(RefusedError, match=r"cell: tare  refused: not now; the reading must be steady"):
        cell.tare()


def test_the_shunt_is_switched_for_a_time_and_its_force_returned(cell):
    cell._line.requests.clear()
    cell._line.replies["shunt"] = 0, 800_000
    assert (cell.switch_shunt_on(15.5), cell.switch_shunt_off()) == (1000.0, 1000.0)
    assert cell._line.requests == [("shunt", 15_500), ("shunt", 0)]
    cell._line.replies["shunt"] = 0, 0
    assert cell.switch_shunt_off() is None


@pytest.mark.parametrize("duration", [0.0, -1.0, 60.001])
def test_a_time_that_the_shunt_does_not_allow_is_not_sent(cell, duration):
    cell._line.requests.clear()
    with pytest.raises(OutOfRangeError, match=r"cell: the shunt cannot be on for \S+ s, only for 0.001 s to 60 s"):
        cell.switch_shunt_on(duration)
    assert cell._line.requests == []


def test_a_load_cell_without_a_shunt_refuses_the_command(cell):
    cell._line.replies["shunt"] = CONTRACT["codes"]["unknown_command"], 0
    with pytest.raises(RefusedError, match=r"cell: shunt 1000 refused: unknown command; .* has one"):
        cell.switch_shunt_on(1.0)
    with pytest.raises(RefusedError):
        cell.switch_shunt_off()


def test_an_indicator_has_no_shunt():
    indicator = AsciiLoadCell("indicator", "/dev/null", lambda: 0)
    assert indicator.longest_shunt == 0.0
    with pytest.raises(RefusedError, match=r"indicator: .* no shunt .*; use a load cell with driver load_cell"):
        indicator.switch_shunt_on(1.0)


def test_samples_with_the_shunt_are_uncertain_from_a_block_of_their_own(cell):
    cell._line.send(800, 800)
    cell._line.send(800_800, 800_800, status=0x10, first=2)
    cell._line.send(900_800, status=0x18, first=4)
    blocks = [block for block in cell.acquire(0.0) if block.channel == "force_raw"]
    assert [(block.first, block.quality) for block in blocks] == [(0, "good"), (2, "uncertain"), (4, "bad")]
    assert blocks[1].values.tolist() == [1001.0, 1001.0]


def test_a_request_without_a_reply_is_repeated_twice(cell, monkeypatch):
    monkeypatch.setitem(CONTRACT["deadlines"], "reply_s", 0.0)
    cell._line.replies["tare"] = None, 0
    cell._line.requests.clear()
    with pytest.raises(NoReplyError, match="sent 3 times"):
        cell.tare()
    assert cell._line.requests == [("tare", 0)] * 3


@pytest.mark.parametrize("rate", [10, 500])
def test_a_running_stream_is_restarted_at_a_new_rate(cell, rate):
    cell._line.requests.clear()
    cell.set_rate(rate)
    assert cell._line.requests == [("stop", 0), ("set_rate", rate), ("start", 0)]


def test_a_stopped_stream_is_not_started_by_a_new_rate(cell):
    cell.stop()
    cell._line.requests.clear()
    cell.set_rate(100)
    assert cell._line.requests == [("set_rate", 100)]
    assert cell.get_health().message == "stopped"


def test_a_rate_that_is_not_offered_or_not_confirmed_is_an_error(cell):
    with pytest.raises(OutOfRangeError, match="333 Hz is not one of the rates"):
        cell.set_rate(333)
    cell._line.replies["set_rate"] = 0, 50
    with pytest.raises(InvalidReplyError, match="set_rate gave 50 Hz, not 100 Hz"):
        cell.set_rate(100)


def test_another_calibration_is_refused_and_the_line_closed(monkeypatch):
    monkeypatch.setattr("drivers.load_cell.load_cell.SerialLine", Line)
    cell = LoadCell("cell", "/dev/null", lambda: 0)
    cell._line.write = lambda data, write=cell._line.write: write(data)
    monkeypatch.setitem(CONTRACT["instrument"], "counts_per_newton", 801)
    with pytest.raises(InvalidReplyError, match="counts_per_newton 800, expected 801"):
        cell.connect()
    assert not cell._line.is_open


@pytest.mark.parametrize(
    ("status", "message"),
    [
        (0, ""),
        (0x06, ""),
        (0x01, "overload"),
        (0x08, "sensor fault"),
        (0x09, "overload; sensor fault"),
        (0x10, "the shunt is on, so the force contains the one that it simulates"),
    ],
)
def test_the_status_of_the_latest_sample_is_reported(cell, status, message):
    cell._line.send(800, status=status)
    cell.acquire(0.0)
    assert cell.get_health().message == message


@pytest.mark.parametrize(("repeats", "message"), [(200, ""), (201, "stuck: the same reading 201 times")])
def test_a_reading_that_repeats_is_reported(cell, repeats, message):
    """200 repetitions of a first reading count as stuck."""
    cell._line.send(*[800] * repeats)
    cell.acquire(0.0)
    assert cell.get_health().message == message


@pytest.mark.parametrize(
    ("rate", "silence_ms", "message"),
    [(1000, 100, ""), (1000, 101, "silent for 0.101 s"), (10, 500, ""), (10, 501, "silent for 0.501 s")],
)
def test_silence_is_reported_after_a_tenth_of_a_second_or_five_samples(
    cell, monkeypatch, rate, silence_ms, message
):
    cell.set_rate(rate)
    monkeypatch.setattr(Line, "now", silence_ms * MS)
    assert cell.get_health().message == message


def test_a_value_is_that_of_the_next_sample_which_is_still_acquired(cell, monkeypatch):
    cell._line.send(800)
    cell.acquire(0.0)
    monkeypatch.setattr(Line, "now", 5 * MS)
    cell._line.send(1_600, first=1)
    reading = cell.read("force_raw")
    assert reading == (2.0, 5 * MS, MS, 1_600.0, "good")
    assert [block.first for block in cell.acquire(0.0)] == [1, 1]


def test_a_value_that_does_not_come_is_an_error(cell, monkeypatch):
    cell._line.send(800)
    cell.acquire(0.0)
    monkeypatch.setitem(CONTRACT["deadlines"], "reply_s", -1.0)
    with pytest.raises(NoReplyError, match=r"no sample of force within -0\.999 s"):
        cell.read("force")


def test_measured_channels_cannot_be_written(cell):
    with pytest.raises(OutOfRangeError, match="force is measured"):
        cell.write("force", 1.0)
    with pytest.raises(OutOfRangeError, match="no channel 'torque', only force, force_raw"):
        cell.read("torque")


def test_counts_begin_with_the_connection(cell):
    cell._line.send(800, 800, first=1)
    cell.acquire(0.0)
    before = cell.get_health()
    cell.connect()
    after = cell.get_health()
    assert (before.lost, after.lost) == (1, 0)
    cell.close()
    assert cell.get_health().message == "not connected"

"""Step table: words that are written and read back, and step times that are refused."""

from types import SimpleNamespace

import numpy as np
import pytest

from drivers.channel import Channel
from drivers.errors import InvalidReplyError, OutOfRangeError
from drivers.modbus.step_table import StepTable, TableProgress, TableState
from drivers.transport.modbus_registers import load_register_map

CAPACITY = 1024


class Registers:
    """Amplifier that keeps what is written, except words at given addresses."""

    def __init__(self, *broken, **state):
        self.map, self.words, self.requests, self.broken, self.state = (
            load_register_map("coil_amplifier"), {}, [], broken, state
        )  # fmt: skip
        self.line = SimpleNamespace(name="coil", write=self.write_words, read=self.read_words)

    def write_words(self, address, words):
        self.requests.append((address, len(words)))
        self.words |= {address + k: word for k, word in enumerate(words) if address + k not in self.broken}

    def read_words(self, table, address, count):
        return SimpleNamespace(words=[self.words.get(address + k, 0xDEAD) for k in range(count)])

    def write(self, name, value):
        self.requests.append((name, value))

    def read_group(self, *names):
        return {name: SimpleNamespace(raw=self.state[name]) for name in names}, None


def make_table(*broken, **state):
    registers = Registers(*broken, **state)
    return StepTable(registers, Channel("coil_drive", "V", -10.0, 10.0, "read_write", "")), registers


def test_a_step_is_a_time_in_microseconds_and_a_level_in_millionths():
    table, registers = make_table()
    table.upload(np.array([0.0, 0.1]), np.array([-1.5, 2.0]))
    # 100 000 = 1 x 65 536 + 34 464; -1 500 000 and 2 000 000 as two's complement of 32 bits.
    words = [0, 0, 0xFFE9, 0x1CA0, 1, 34_464, 0x001E, 0x8480]
    assert [registers.words[1000 + k] for k in range(8)] == words
    assert registers.requests == [(1000, 8), ("table_length", 2)]


def test_a_long_table_is_written_in_whole_steps():
    """A request has 120 words of 30 steps at most."""
    table, registers = make_table()
    table.upload(np.arange(61) * 1e-3, np.zeros(61))
    assert registers.requests == [(1000, 120), (1120, 120), (1240, 4), ("table_length", 61)]


@pytest.mark.parametrize("address", [1000, 1119, 1120, 1243])
def test_a_word_that_reads_differently_is_detected_in_every_request(address):
    table, _ = make_table(address)
    with pytest.raises(InvalidReplyError, match="reads back other values"):
        table.upload(np.arange(61) * 1e-3, np.zeros(61))


@pytest.mark.parametrize(
    "times",
    [[0.0], [0.5], [0.0, 1e-6], [0.0, 4294.967294], np.arange(CAPACITY) * 1e-3],
    ids=["one", "later", "resolution", "longest", "capacity"],
)
def test_step_times_at_their_limits_are_accepted(times):
    table, registers = make_table()
    table.upload(np.array(times), np.zeros(len(times)))
    assert registers.requests[-1] == ("table_length", len(times))


@pytest.mark.parametrize(
    ("times", "message"),
    [
        ([], "0 steps, its table holds 1 to 1024"),
        (np.arange(CAPACITY + 1) * 1e-3, "1025 steps"),
        ([-1e-6, 0.1], "from 0 to 4295 s"),
        ([0.0, 0.9e-6], "at least 1 us each"),
        ([0.0, 0.2, 0.1], "at least 1 us each"),
        ([0.0, 4294.967297], "from 0 to 4295 s"),
    ],
)
def test_other_step_times_are_refused_before_anything_is_sent(times, message):
    table, registers = make_table()
    with pytest.raises(OutOfRangeError, match=message):
        table.upload(np.array(times), np.zeros(len(times)))
    assert registers.requests == []


def test_times_and_levels_of_different_number_are_refused():
    with pytest.raises(OutOfRangeError, match="2 times and 1 levels"):
        make_table()[0].upload(np.array([0.0, 1.0]), np.zeros(1))


@pytest.mark.parametrize(("state", "started_ns"), [(0, None), (1, None), (2, 5_000), (3, 5_000)])
def test_the_time_of_the_trigger_is_known_once_the_table_runs(state, started_ns):
    table, _ = make_table(table_state=state, table_started=5)
    assert table.read_progress(lambda microseconds: microseconds * 1000) == (state, started_ns)
    assert table.read_progress() == TableProgress(TableState(state), None)

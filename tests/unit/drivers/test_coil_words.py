"""What the coil amplifier says of itself, known to its data sheet or not."""

from types import SimpleNamespace

import pytest

from drivers.channel import Channel
from drivers.coil_amplifier import CoilFault, CoilState, Condition
from drivers.coil_table import StepTable, TableState
from drivers.errors import BadReply
from drivers.modbus_registers import load_map


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (0, ""),
        (2, "open coil"),
        (8, "fault 08h, see the amplifier's manual"),
        (1 | 16, "over temperature, fault 10h, see the amplifier's manual"),
    ],
)
def test_a_fault_that_nobody_knows_does_not_read_as_health(fault, words):
    assert Condition(CoilFault(fault), CoilState(0), 0.0).words == words


class Registers:
    """An amplifier whose table is in a given state."""

    def __init__(self, state):
        self.map = load_map("coil_amplifier")
        self.line = SimpleNamespace(name="coil")
        self._state = state

    def read_together(self, *names):
        return {name: SimpleNamespace(raw=self._state if name == "table_state" else 0) for name in names}, None


@pytest.mark.parametrize("state", TableState)
def test_the_table_says_how_far_it_is(state):
    table = StepTable(Registers(int(state)), Channel("coil_drive", "V", -1, 1, "read_write", ""))
    assert table.progress().state is state


def test_a_state_of_the_table_that_is_none_is_a_bad_reply():
    table = StepTable(Registers(77), Channel("coil_drive", "V", -1, 1, "read_write", ""))
    with pytest.raises(BadReply, match="state 77"):
        table.progress()

"""Messages of the coil amplifier, for documented and unknown states."""

from types import SimpleNamespace

import pytest

from drivers.channel import Channel
from drivers.errors import InvalidReplyError
from drivers.modbus.coil_amplifier import AmplifierStatus, CoilFault, CoilState
from drivers.modbus.step_table import StepTable, TableState
from drivers.transport.modbus_registers import load_register_map


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        (0, ""),
        (2, "open coil"),
        (8, "fault 08h, see the amplifier's manual"),
        (1 | 16, "over temperature, fault 10h, see the amplifier's manual"),
    ],
)
def test_an_unknown_fault_has_a_message(fault, message):
    assert AmplifierStatus(CoilFault(fault), CoilState(0), 0.0).message == message


class Registers:
    """An amplifier whose table is in a given state."""

    def __init__(self, state):
        self.map = load_register_map("coil_amplifier")
        self.line = SimpleNamespace(name="coil")
        self._state = state

    def read_group(self, *names):
        return {name: SimpleNamespace(raw=self._state if name == "table_state" else 0) for name in names}, None


@pytest.mark.parametrize("state", TableState)
def test_the_state_of_the_table_is_read(state):
    table = StepTable(Registers(int(state)), Channel("coil_drive", "V", -1, 1, "read_write", ""))
    assert table.read_progress().state is state


def test_an_unknown_state_of_the_table_is_an_invalid_reply():
    table = StepTable(Registers(77), Channel("coil_drive", "V", -1, 1, "read_write", ""))
    with pytest.raises(InvalidReplyError, match="state 77"):
        table.read_progress()

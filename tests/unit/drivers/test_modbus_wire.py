"""What a Modbus instrument does about a wire that is none, and about a request that is refused."""

import pytest

from drivers.coil_amplifier import CoilAmplifier
from drivers.errors import NoReply, NotConnected, Refused
from drivers.lvdt import Lvdt
from drivers.modbus_address import ModbusAddress

SOMEWHERE = ModbusAddress("tcp://127.0.0.1:5020")


def clock():
    return 0


@pytest.mark.parametrize("url", ["tcp://127.0.0.1:lots", "tcp://127.0.0.1:99999"])
def test_an_address_that_is_none_is_not_connected(url):
    with pytest.raises(NotConnected, match=f"lvdt: {url} cannot be opened: Port"):
        Lvdt("lvdt", ModbusAddress(url), clock).connect()


def test_everybody_who_listens_is_told():
    lvdt, first, second = Lvdt("lvdt", SOMEWHERE, clock), [], []
    lvdt.listen(first.append)
    lvdt.listen(second.append)
    lvdt._line._trace(True, b"question")
    assert first == second
    assert len(first) == 1


class Amplifier(CoilAmplifier):
    """An amplifier whose requests are noted, and fail as they are told to."""

    def __init__(self, *refusals):
        super().__init__("coil", SOMEWHERE, clock)
        self.asked, refusals = [], dict(refusals)

        def write(name, value):
            self.asked.append((name, value))
            if name in refusals:
                raise refusals[name]

        self._registers.write = write


def test_an_amplifier_with_nothing_to_abort_is_told_to_go_to_zero_all_the_same():
    coil = Amplifier(("table_command", Refused("coil: there is no table")))
    coil.make_safe()
    assert coil.asked[-1] == ("setpoint", 0.0)
    assert coil.health().words == "not connected"


def test_a_zero_that_was_not_confirmed_is_asked_for_again_and_said():
    coil = Amplifier(("setpoint", NoReply("coil: no answer")))
    coil.make_safe()
    assert [name for name, _ in coil.asked].count("setpoint") == 2
    assert "zero output not confirmed: coil: no answer" in coil.health().words

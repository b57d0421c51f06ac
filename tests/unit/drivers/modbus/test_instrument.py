"""A Modbus instrument with an invalid address, and with refused requests."""

from types import SimpleNamespace

import pytest

from drivers.errors import NoReplyError, NotConnectedError, RefusedError
from drivers.modbus.coil_amplifier import CoilAmplifier
from drivers.modbus.lvdt import Lvdt
from drivers.transport.modbus_address import ModbusAddress

SOMEWHERE = ModbusAddress("tcp://127.0.0.1:5020")


def clock():
    return 0


@pytest.mark.parametrize("url", ["tcp://127.0.0.1:lots", "tcp://127.0.0.1:99999"])
def test_an_invalid_address_is_not_connected(url):
    with pytest.raises(NotConnectedError, match=f"lvdt: {url} cannot be opened: Port"):
        Lvdt("lvdt", ModbusAddress(url), clock).connect()


def test_every_listener_gets_every_frame():
    lvdt, first, second = Lvdt("lvdt", SOMEWHERE, clock), [], []
    lvdt.add_listener(first.append)
    lvdt.add_listener(second.append)
    lvdt._line._trace(True, b"request")
    assert first == second
    assert len(first) == 1


class Amplifier(CoilAmplifier):
    """An amplifier that records its writes, and refuses some of them."""

    def __init__(self, *refusals, output=0.0):
        super().__init__("coil", SOMEWHERE, clock)
        self.writes, refusals = [], dict(refusals)
        self.read_status = lambda: SimpleNamespace(output=output)

        def write(name, value):
            self.writes.append((name, value))
            if name in refusals:
                raise refusals[name]

        self._registers.write = write


def test_a_refused_abort_does_not_keep_the_output_on():
    coil = Amplifier(("table_command", RefusedError("coil: there is no table")))
    assert coil.make_safe() == ""
    assert coil.writes[-1] == ("setpoint", 0.0)
    assert coil.get_health().message == "not connected"


def test_an_unconfirmed_zero_is_repeated_and_reported():
    coil = Amplifier(("setpoint", NoReplyError("coil: no reply")), output=0.3)
    assert coil.make_safe() == "coil: no reply"
    assert [name for name, _ in coil.writes].count("setpoint") == 2
    assert "zero output not confirmed: coil: no reply" in coil.get_health().message


def test_an_accepted_setpoint_is_not_yet_zero_output():
    coil = Amplifier(output=0.3)
    assert coil.ramp_down() == ""
    assert "the output is still at 0.3 V" in coil.make_safe()
    assert "zero output not confirmed" in coil.get_health().message


def test_zero_output_after_a_refused_setpoint_is_confirmed():
    """After a fault the amplifier refuses setpoints and has switched its output off."""
    coil = Amplifier(("setpoint", RefusedError("coil: fault")))
    assert coil.make_safe() == ""
    assert coil.get_health().message == "not connected"

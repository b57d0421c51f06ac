import pytest

from bench.rig.instruments import Named, Rig
from drivers.errors import DriverError, NoReply, NotConnected


class Instrument:
    """One that connects, or says why not."""

    def __init__(self, error=None):
        self.error, self.closed = error, 0

    def connect(self):
        if self.error is not None:
            raise self.error

    def close(self):
        self.closed += 1


def rig(**instruments):
    named = tuple(Named(name, name, "somewhere", instrument) for name, instrument in instruments.items())
    return Rig(*(None,) * 5, named=named, drive_kind="coil_v", drive_unit="V", drive_channel="coil_voltage")


def test_every_instrument_that_fails_is_named_at_once_and_all_are_closed():
    found = {
        "lvdt": Instrument(NotConnected("lvdt: tcp://127.0.0.1:1 cannot be opened")),
        "load_cell": Instrument(),
        "actuator": Instrument(NoReply("actuator: silent for 1 s")),
    }
    with (
        pytest.raises(DriverError, match=r"2 of 3 .*lvdt: tcp.* cannot be opened; actuator: silent for 1 s"),
        rig(**found).connected(),
    ):
        pass
    assert [instrument.closed for instrument in found.values()] == [1, 1, 1]


def test_a_single_failure_keeps_its_kind():
    found = rig(lvdt=Instrument(NoReply("lvdt: silent")), load_cell=Instrument())
    with pytest.raises(NoReply, match=r"^lvdt: silent$"), found.connected():
        pass


def test_what_was_connected_is_closed_in_the_end():
    one = Instrument()
    with rig(lvdt=one).connected():
        assert one.closed == 0
    assert one.closed == 1

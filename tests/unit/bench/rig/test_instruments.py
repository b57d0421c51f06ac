"""Instruments of a rig, connected and closed together."""

import pytest

from bench.rig.instruments import RegisteredInstrument, Rig
from drivers.errors import DriverError, NoReplyError, NotConnectedError


class FakeInstrument:
    """Instrument that connects, or raises an error."""

    def __init__(self, error=None):
        self.error, self.close_count = error, 0

    def connect(self):
        if self.error is not None:
            raise self.error

    def close(self):
        self.close_count += 1


def make_rig(**instruments):
    registered = tuple(
        RegisteredInstrument(name, name, "address", instrument) for name, instrument in instruments.items()
    )
    roles = (None,) * 5
    return Rig(*roles, instruments=registered, drive_kind="coil_v", drive_unit="V", drive_channel="coil_voltage")


def test_all_failing_instruments_are_named_together_and_all_are_closed():
    instruments = {
        "lvdt": FakeInstrument(NotConnectedError("lvdt: tcp://127.0.0.1:1 cannot be opened")),
        "load_cell": FakeInstrument(),
        "actuator": FakeInstrument(NoReplyError("actuator: silent for 1 s")),
    }
    with (
        pytest.raises(DriverError, match=r"2 of 3 .*lvdt: tcp.* cannot be opened; actuator: silent for 1 s"),
        make_rig(**instruments).connect_all(),
    ):
        pass
    assert [instrument.close_count for instrument in instruments.values()] == [1, 1, 1]


def test_single_failure_keeps_its_class():
    rig = make_rig(lvdt=FakeInstrument(NoReplyError("lvdt: silent")), load_cell=FakeInstrument())
    with pytest.raises(NoReplyError, match=r"^lvdt: silent$"), rig.connect_all():
        pass


def test_connected_instruments_are_closed_at_the_end():
    instrument = FakeInstrument()
    with make_rig(lvdt=instrument).connect_all():
        assert instrument.close_count == 0
    assert instrument.close_count == 1

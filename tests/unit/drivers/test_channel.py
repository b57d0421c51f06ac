import math

import pytest

from drivers.ascii_load_cell import AsciiLoadCell
from drivers.channel import Channel
from drivers.errors import BadReply, DriverError, NoReply, NotConnected, OutOfRange, Refused
from drivers.instrument import Instrument
from drivers.load_cell import LoadCell

STROKE = Channel("displacement", "m", -0.05, 0.05, "read_write", "stroke of the actuator")


@pytest.mark.parametrize("value", [-0.05, 0.0, 0.05])
def test_a_value_in_range_passes_unchanged(value):
    assert STROKE.checked(value) == value


@pytest.mark.parametrize("value", [-0.051, 0.0500001, math.inf, -math.inf, math.nan])
def test_a_value_out_of_range_is_refused_with_value_limit_and_unit(value):
    with pytest.raises(OutOfRange, match=r"displacement: \S+ m lies outside -0.05 to 0.05 m; nothing was sent"):
        STROKE.checked(value)


@pytest.mark.parametrize("error", [NotConnected, NoReply, BadReply, Refused, OutOfRange])
def test_every_error_of_a_driver_can_be_caught_as_one(error):
    assert issubclass(error, DriverError)
    assert error("said").exit_code == 1


@pytest.mark.parametrize("driver", [LoadCell, AsciiLoadCell])
def test_a_driver_can_what_every_instrument_can(driver):
    instrument = driver("force", "/dev/null", lambda: 0)
    promised = {name for name in vars(Instrument) if not name.startswith("_")}
    assert promised <= set(dir(instrument))
    assert {channel.name for channel in instrument.channels} == {"force", "force_raw"}
    assert {channel.unit for channel in instrument.channels} == {"N"}


def test_a_load_cell_of_a_rate_that_is_not_offered_is_not_made():
    with pytest.raises(OutOfRange, match="999 Hz is none of the rates"):
        LoadCell("force", "/dev/null", lambda: 0, rate=999)

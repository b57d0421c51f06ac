import math

import pytest

from drivers.channel import Channel
from drivers.errors import (
    DriverError,
    InvalidReplyError,
    NoReplyError,
    NotConnectedError,
    OutOfRangeError,
    RefusedError,
)
from drivers.instrument import Instrument
from drivers.load_cell.ascii_load_cell import AsciiLoadCell
from drivers.load_cell.load_cell import LoadCell

STROKE = Channel("displacement", "m", -0.05, 0.05, "read_write", "stroke of the actuator")


@pytest.mark.parametrize("value", [-0.05, 0.0, 0.05])
def test_a_value_in_range_passes_unchanged(value):
    assert STROKE.validate(value) == value


@pytest.mark.parametrize("value", [-0.051, 0.0500001, math.inf, -math.inf, math.nan])
def test_a_value_out_of_range_is_refused_with_value_limit_and_unit(value):
    with pytest.raises(OutOfRangeError, match=r"displacement: \S+ m is outside -0.05 to 0.05 m; nothing was sent"):
        STROKE.validate(value)


@pytest.mark.parametrize(
    "error", [NotConnectedError, NoReplyError, InvalidReplyError, RefusedError, OutOfRangeError]
)
def test_every_error_of_a_driver_can_be_caught_as_one(error):
    assert issubclass(error, DriverError)
    assert error("refused").exit_code == 1


@pytest.mark.parametrize("driver", [LoadCell, AsciiLoadCell])
def test_a_driver_implements_the_instrument_interface(driver):
    instrument = driver("force", "/dev/null", lambda: 0)
    interface = {name for name in vars(Instrument) if not name.startswith("_")}
    assert interface <= set(dir(instrument))
    assert {channel.name for channel in instrument.channels} == {"force", "force_raw"}
    assert {channel.unit for channel in instrument.channels} == {"N"}


def test_a_rate_that_the_load_cell_does_not_offer_is_refused():
    with pytest.raises(OutOfRangeError, match="999 Hz is not one of the rates"):
        LoadCell("force", "/dev/null", lambda: 0, rate=999)

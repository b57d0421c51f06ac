"""Where a decoder is to be made of what a log says."""

import pytest

from drivers.errors import BadReply
from drivers.replay import decoder


@pytest.mark.parametrize(
    "description",
    [
        {},
        {"decoder": "modem"},
        {"decoder": "load_cell", "state": {}},
        {"decoder": "modbus_ring", "instrument": "gyroscope", "rtu": False, "state": {"at_ns": 0}},
    ],
)
def test_a_description_that_is_none_is_refused_in_words(description):
    with pytest.raises(BadReply, match="cannot be made"):
        decoder(description)

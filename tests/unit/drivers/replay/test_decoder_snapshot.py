"""Decoders made from the snapshots in a log."""

import pytest

from drivers.errors import InvalidReplyError
from drivers.replay.decoder import make_decoder


@pytest.mark.parametrize(
    "snapshot",
    [
        {},
        {"decoder": "modem"},
        {"decoder": "load_cell", "state": {}},
        {"decoder": "modbus_ring", "instrument": "gyroscope", "rtu": False, "state": {"at_ns": 0}},
    ],
)
def test_an_invalid_snapshot_is_refused(snapshot):
    with pytest.raises(InvalidReplyError, match="cannot be made"):
        make_decoder(snapshot)

"""Binary form of live batches, and their division where samples are missing."""

import math
import struct

import numpy as np
import pytest

from bench.errors import LiveDataError
from bench.live import (
    MAX_SEQUENCE,
    BatchMaker,
    Channel,
    LiveBatch,
    decode_batch,
    describe_channels,
    parse_channels,
)

CHANNELS = (Channel("force", "N"), Channel("displacement", "m"))


def test_the_binary_form_is_that_of_the_contract():
    values = np.array([[1.5, -2.0, math.nan], [0.25, 0.5, 0.75]], np.float32)
    data = LiveBatch(7, 1_790_000_000.125, 1e-3, CHANNELS, values).encode()
    assert struct.unpack_from("<IId", data) == (1, 7, 1_790_000_000.125)
    count, period = struct.unpack_from("<If", data, 16)
    assert (count, period) == (3, pytest.approx(1e-3))
    np.testing.assert_array_equal(struct.unpack_from("<6f", data, 24), values.ravel())
    assert len(data) == 24 + 4 * 6


def test_a_batch_is_decoded_as_it_was_encoded():
    values = np.arange(8, dtype=np.float32).reshape(2, 4)
    found = decode_batch(LiveBatch(3, 50.0, 0.5, CHANNELS, values).encode(), CHANNELS)
    assert (found.sequence, found.utc_s, found.period_s, found.count, found.end_utc_s) == (3, 50.0, 0.5, 4, 51.5)
    np.testing.assert_array_equal(found.values, values)


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"short", "5 bytes"),
        (struct.pack("<IIdIf", 2, 0, 0.0, 0, 1.0), "version 2"),
        (struct.pack("<IIdIf", 1, 0, 0.0, 1, 1.0), "expected 32 for 2 channels"),
    ],
)
def test_other_data_is_refused_with_its_reason(data, reason):
    with pytest.raises(LiveDataError, match=reason):
        decode_batch(data, CHANNELS)


def test_the_list_of_channels_keeps_names_units_and_order():
    assert parse_channels(describe_channels(CHANNELS)) == CHANNELS
    with pytest.raises(LiveDataError, match="not a list of channels"):
        parse_channels(b"[{}]")


def test_samples_of_the_bench_become_one_batch_with_stamp_and_units():
    maker = BatchMaker({"force": "N"})
    time_ns = 5_000_000_000 + np.arange(4) * 2_000_000
    (first,) = maker.make(time_ns, {"force": np.arange(4.0), "segment": np.zeros(4)}, 1000.0)
    assert (first.sequence, first.utc_s, first.count) == (0, 1005.0, 4)
    assert first.period_s == pytest.approx(0.002)
    assert first.channels == (("force", "N"), ("segment", "1"))


def test_another_batch_begins_where_samples_are_missing():
    time_ns = np.array([0, 1, 2, 3, 9, 10, 11]) * 1_000_000
    batches = list(BatchMaker({}).make(time_ns, {"force": np.arange(7.0)}, 0.0))
    assert [(one.sequence, one.count, one.utc_s) for one in batches] == [
        (0, 4, 0.0),
        (1, 3, pytest.approx(0.009)),
    ]
    assert [one.period_s for one in batches] == pytest.approx([1e-3, 1e-3])


def test_the_sequence_number_begins_again_at_zero_after_its_largest_value():
    maker = BatchMaker({})
    maker._sequence = MAX_SEQUENCE
    numbers = [next(maker.make(np.array([k]), {"force": np.ones(1)}, 0.0)).sequence for k in range(2)]
    assert numbers == [MAX_SEQUENCE, 0]

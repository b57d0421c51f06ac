"""Binary batches of recorded samples."""

import struct

import numpy as np
import pytest

from bench.samples import decode_batches, encode_batches

UTC = 1_772_359_200.0


def make(count=20_000):
    time = np.arange(count) * 1e-3
    return time, [np.sin(time).astype(np.float32), np.cos(time).astype(np.float32)]


def test_samples_are_the_same_after_encoding_and_decoding():
    time, columns = make()
    time[15_000:] += 3.25  # a gap between two stretches
    decoded, values = decode_batches(b"".join(encode_batches(time, columns, UTC)), 3)
    np.testing.assert_allclose(decoded - UTC, time, atol=2e-6)
    for value, column in zip(values, columns, strict=True):
        np.testing.assert_array_equal(value, column)


def test_a_batch_begins_with_the_header_of_the_live_stream():
    time, columns = make(100)
    (batch,) = encode_batches(time, columns, UTC)
    assert struct.unpack_from("<IId", batch) == (1, 0, UTC)
    assert struct.unpack_from("<If", batch, 16) == (100, pytest.approx(1e-3))
    assert len(batch) == 24 + 3 * 100 * 4


def test_batches_are_numbered():
    time, columns = make()
    numbers = [struct.unpack_from("<II", batch)[1] for batch in encode_batches(time, columns, UTC)]
    assert numbers == [0, 1, 2]


def test_no_samples_are_no_batches():
    assert list(encode_batches(np.empty(0), [np.empty(0, np.float32)], 0.0)) == []
    time, columns = decode_batches(b"", 2)
    assert (len(time), len(columns)) == (0, 1)


@pytest.mark.parametrize("cut", [3, 30])
def test_incomplete_batches_are_refused(cut):
    time, columns = make(100)
    content = b"".join(encode_batches(time, columns, UTC))
    with pytest.raises(ValueError, match="incomplete"):
        decode_batches(content[:cut], 3)

from binascii import crc_hqx
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from drivers.load_cell.decoder import LoadCellDecoder
from drivers.load_cell.frames import (
    CONTRACT,
    Acknowledgement,
    FrameDecoder,
    Identity,
    Request,
    Sample,
    encode_frame,
)

fixed = settings(derandomize=True, deadline=None)

FILLER = bytes(32)
"""Longer than any frame, so that no bytes stay pending."""
STARTED = encode_frame(Acknowledgement(1, CONTRACT["commands"]["start"], 0, 1000))

counts = st.integers(-8_000_000, 8_000_000)
samples = st.builds(Sample, st.integers(0, 65535), st.integers(0, 2**32 - 1), counts, counts, st.integers(0, 31))
frames = st.one_of(samples, st.builds(Acknowledgement, *[st.integers(0, 255)] * 3, counts))


@st.composite
def broken_frames(draw):
    """Draw a frame without its end or its beginning, or with one flipped bit."""
    frame = encode_frame(draw(samples))
    cut = draw(st.integers(1, len(frame) - 1))
    flipped = bytes([frame[cut] ^ (1 << draw(st.integers(0, 7)))])
    return draw(st.sampled_from([frame[:cut], frame[cut:], frame[:cut] + flipped + frame[cut + 1 :]]))


def contains_a_frame(noise):
    """Return whether noise contains a valid sample, if necessary with the sync word after it.

    A frame whose missing end equals the beginning of the next frame is valid; the next frame is then lost.
    """
    noise += b"\xa5\x5a"
    parts = [noise[start : start + 21] for start in range(len(noise) - 20)]
    return any(
        part[:4] == b"\xa5\x5a\x0f\x01" and crc_hqx(part[2:-2], 0xFFFF) == int.from_bytes(part[-2:], "little")
        for part in parts
    )


garbage = st.one_of(
    st.binary(max_size=60), broken_frames(), st.sampled_from([b"\xa5", b"\xa5\x5a", b"\xa5\x5a\x0f\x01"])
)


def split(stream, cuts):
    """Split a stream at these positions."""
    positions = [0, *sorted(cut % (len(stream) + 1) for cut in cuts), len(stream)]
    return [stream[a:b] for a, b in pairwise(positions)]


def decode(stream, cuts=()):
    decoder = FrameDecoder()
    return [packet for piece in split(stream, cuts) for packet in decoder.feed(piece)]


@fixed
@given(st.lists(frames, max_size=12), st.lists(st.integers(0, 500)))
def test_any_split_of_a_good_stream_gives_every_frame(packets, cuts):
    assert decode(b"".join(map(encode_frame, packets)), cuts) == packets


@settings(fixed, max_examples=300)
@given(st.lists(st.tuples(st.lists(garbage, max_size=3), samples), max_size=10), st.lists(st.integers(0, 1000)))
def test_garbage_neither_hides_a_good_frame_nor_makes_a_wrong_one(stretches, cuts):
    assume(not any(contains_a_frame(b"".join(noise)) for noise, _ in stretches))
    stream = b"".join(b"".join(noise) + encode_frame(sample) for noise, sample in stretches)
    assert decode(stream + FILLER, cuts) == [sample for _, sample in stretches]


@fixed
@given(st.binary(max_size=400))
def test_noise_alone_makes_no_frame_and_is_discarded(noise):
    decoder = FrameDecoder()
    assert decoder.feed(noise) == []
    assert decoder.feed(FILLER) == []
    assert decoder.feed(encode_frame(Sample(1, 2, 3, 4, 0))) == [Sample(1, 2, 3, 4, 0)]


def test_broken_frames_and_resynchronisations_are_counted():
    decoder = FrameDecoder()
    good = encode_frame(Sample(1, 2, 3, 4, 0))
    bad = good[:10] + b"\xff" + good[11:]
    assert len(decoder.feed(good + bad + bad + good + b"noise" + good)) == 3
    assert (decoder.corrupted, decoder.resynchronised) == (2, 2)


@pytest.mark.parametrize(
    "packet",
    [Sample(65535, 2**32 - 1, -(2**31), 2**31 - 1, 255), Request(1, 5, 1000), Identity(255, 6, 1, 2, 800)],
)
def test_every_packet_is_decoded_from_its_frame(packet):
    assert decode(encode_frame(packet)) == [packet]


def test_the_checksum_is_that_of_the_wire_file():
    checksum = CONTRACT["checksum"]
    assert crc_hqx(b"123456789", checksum["start"]) == checksum["check"]


def test_the_line_is_fast_enough_for_every_rate():
    characters = CONTRACT["line"]["baud"] / CONTRACT["line"]["bits_per_character"]
    assert max(CONTRACT["instrument"]["rates_hz"]) * len(encode_frame(Sample(0, 0, 0, 0, 0))) < 0.5 * characters


def make_frames(ticks, first_time=0):
    """Return the frames of the samples at these milliseconds, each with its tick as counts."""
    return [encode_frame(Sample(k % 65536, (first_time + 1000 * k) % 2**32, k, 0, 0)) for k in ticks]


def feed(decoder, chunks, first_ns=0, step_ns=1_000_000):
    return [
        block
        for index, chunk in enumerate(chunks)
        for block in decoder.feed(first_ns + index * step_ns, chunk)
        if block.channel == "force_raw"
    ]


@fixed
@given(st.lists(st.integers(1, 200_000), min_size=1, max_size=30), st.integers(0, 2**32 - 1))
def test_numbers_times_and_losses_are_right_over_every_wrap(gaps, first_time):
    ticks = np.cumsum([0, *gaps])
    decoder = LoadCellDecoder()
    decoder.feed(0, STARTED)
    blocks = [
        block
        for tick, frame in zip(ticks.tolist(), make_frames(ticks.tolist(), first_time), strict=True)
        for block in decoder.feed(tick * 1_000_000, frame)
        if block.channel == "force_raw"
    ]
    assert [block.first for block in blocks] == ticks.tolist()
    assert [int(block.device_ns[0]) for block in blocks] == [
        (first_time + 1000 * k) * 1000 for k in ticks.tolist()
    ]
    assert decoder.get_statistics().lost == ticks[-1] - len(gaps)


@fixed
@given(st.lists(st.integers(0, 2000)), st.sets(st.integers(0, 59), max_size=20))
def test_any_split_gives_the_same_samples(cuts, missing):
    arrived = [tick for tick in range(60) if tick not in missing]
    bytes_ = STARTED + b"".join(make_frames(arrived))
    decoder = LoadCellDecoder()
    blocks = feed(decoder, split(bytes_, cuts))
    numbers = [block.first + index for block in blocks for index in range(len(block.values))]
    values = [value for block in blocks for value in block.raw]
    assert numbers == values == arrived


def test_a_missed_wrap_of_the_device_clock_is_known_from_the_bench_clock():
    decoder = LoadCellDecoder()
    hours_ns = 3 * 3600 * 1_000_000_000
    decoder.feed(0, STARTED + b"".join(make_frames([0])))
    (block, _) = decoder.feed(hours_ns, b"".join(make_frames([hours_ns // 1_000_000])))
    assert block.device_ns[0] == hours_ns
    assert decoder.get_statistics().lost == hours_ns // 1_000_000 - 1


def test_samples_count_from_start_to_stop_only():
    decoder = LoadCellDecoder()
    stopped = encode_frame(Acknowledgement(2, CONTRACT["commands"]["stop"], 0, 0))
    assert feed(decoder, make_frames(range(5))) == []
    assert feed(decoder, [STARTED, *make_frames(range(5)), stopped, *make_frames(range(5, 9))])[-1].first == 4
    assert feed(decoder, [STARTED, *make_frames([3])])[0].first == 8
    assert decoder.get_statistics().lost == 3


def test_a_refused_start_starts_nothing():
    decoder = LoadCellDecoder()
    refused = encode_frame(Acknowledgement(1, CONTRACT["commands"]["start"], CONTRACT["codes"]["not_now"], 1000))
    assert feed(decoder, [refused, *make_frames(range(3))]) == []


@pytest.mark.parametrize(
    ("sample", "quality"),
    [
        (Sample(0, 0, 800, 80, CONTRACT["status"]["tared"] | CONTRACT["status"]["stable"]), "good"),
        (Sample(0, 0, 800, 0, CONTRACT["status"]["overload"]), "bad"),
        (Sample(0, 0, 800, 0, CONTRACT["status"]["sensor_fault"]), "bad"),
        (Sample(0, 0, 8_000_001, 0, 0), "bad"),
    ],
)
def test_status_and_range_determine_the_quality(sample, quality):
    decoder = LoadCellDecoder()
    force, force_raw = decoder.feed(7, STARTED + encode_frame(sample))
    assert (force.quality, force_raw.quality) == (quality, quality)
    assert force.values[0] == (sample.counts - sample.tare) / 800
    assert force_raw.values[0] == sample.counts / 800


def test_blocks_end_where_samples_are_missing_or_the_quality_changes():
    decoder = LoadCellDecoder()
    bad = encode_frame(Sample(4, 4000, 4, 0, CONTRACT["status"]["overload"]))
    blocks = feed(decoder, [STARTED + b"".join([*make_frames([0, 1, 3]), bad, *make_frames([5, 6])])])
    assert [(block.first, len(block.values), block.quality) for block in blocks] == [
        (0, 2, "good"),
        (3, 1, "good"),
        (4, 1, "bad"),
        (5, 2, "good"),
    ]

import tomllib
from binascii import crc_hqx
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import drivers
from drivers.load_cell_frames import CONTRACT, Acknowledgement, Decoder, Identity, Request, Sample, encode
from drivers.load_cell_stream import SampleStream

fixed = settings(derandomize=True, deadline=None)

SILENCE = bytes(32)
"""Longer than any frame: what waits for more bytes is decided."""
STARTED = encode(Acknowledgement(1, CONTRACT["commands"]["start"], 0, 1000))

counts = st.integers(-8_000_000, 8_000_000)
samples = st.builds(Sample, st.integers(0, 65535), st.integers(0, 2**32 - 1), counts, counts, st.integers(0, 15))
frames = st.one_of(samples, st.builds(Acknowledgement, *[st.integers(0, 255)] * 3, counts))


@st.composite
def broken_frames(draw):
    """A frame that lost its end, its beginning, or one bit."""
    frame = encode(draw(samples))
    place = draw(st.integers(1, len(frame) - 1))
    flipped = bytes([frame[place] ^ (1 << draw(st.integers(0, 7)))])
    return draw(st.sampled_from([frame[:place], frame[place:], frame[:place] + flipped + frame[place + 1 :]]))


def holds_a_frame(noise):
    """Whether pieces of noise make a true sample, with the sync word behind them if need be.

    A frame whose lost end equals the beginning of the next one is whole again, and right; the next one is lost.
    """
    noise += b"\xa5\x5a"
    parts = [noise[place : place + 21] for place in range(len(noise) - 20)]
    return any(
        part[:4] == b"\xa5\x5a\x0f\x01" and crc_hqx(part[2:-2], 0xFFFF) == int.from_bytes(part[-2:], "little")
        for part in parts
    )


garbage = st.one_of(
    st.binary(max_size=60), broken_frames(), st.sampled_from([b"\xa5", b"\xa5\x5a", b"\xa5\x5a\x0f\x01"])
)


def pieces(stream, cuts):
    """The stream, cut at these places."""
    places = [0, *sorted(cut % (len(stream) + 1) for cut in cuts), len(stream)]
    return [stream[a:b] for a, b in pairwise(places)]


def decoded(stream, cuts=()):
    decoder = Decoder()
    return [packet for piece in pieces(stream, cuts) for packet in decoder.feed(piece)]


@fixed
@given(st.lists(frames, max_size=12), st.lists(st.integers(0, 500)))
def test_any_split_of_a_good_stream_gives_every_frame(packets, cuts):
    assert decoded(b"".join(map(encode, packets)), cuts) == packets


@settings(fixed, max_examples=300)
@given(st.lists(st.tuples(st.lists(garbage, max_size=3), samples), max_size=10), st.lists(st.integers(0, 1000)))
def test_garbage_anywhere_hides_no_good_frame_and_makes_no_wrong_one(stretches, cuts):
    assume(not any(holds_a_frame(b"".join(noise)) for noise, _ in stretches))
    stream = b"".join(b"".join(noise) + encode(sample) for noise, sample in stretches)
    assert decoded(stream + SILENCE, cuts) == [sample for _, sample in stretches]


@fixed
@given(st.binary(max_size=400))
def test_noise_alone_is_no_frame_and_is_not_kept(noise):
    decoder = Decoder()
    assert decoder.feed(noise) == []
    assert decoder.feed(SILENCE) == []
    assert decoder.feed(encode(Sample(1, 2, 3, 4, 0))) == [Sample(1, 2, 3, 4, 0)]


def test_broken_frames_and_finding_the_stream_again_are_counted():
    decoder = Decoder()
    good = encode(Sample(1, 2, 3, 4, 0))
    bad = good[:10] + b"\xff" + good[11:]
    assert len(decoder.feed(good + bad + bad + good + b"noise" + good)) == 3
    assert (decoder.corrupted, decoder.resynchronised) == (2, 2)


@pytest.mark.parametrize(
    "packet",
    [Sample(65535, 2**32 - 1, -(2**31), 2**31 - 1, 255), Request(1, 5, 1000), Identity(255, 6, 1, 2, 800)],
)
def test_every_packet_comes_back_from_its_frame(packet):
    assert decoded(encode(packet)) == [packet]


def test_the_contract_says_which_checksum_it_means():
    wire = tomllib.loads((Path(drivers.__file__).parent / "wire" / "load_cell.toml").read_text())
    assert crc_hqx(b"123456789", wire["checksum"]["start"]) == wire["checksum"]["check"]


def test_the_line_carries_every_rate_that_is_offered():
    characters = CONTRACT["line"]["baud"] / CONTRACT["line"]["bits_per_character"]
    assert max(CONTRACT["instrument"]["rates_hz"]) * len(encode(Sample(0, 0, 0, 0, 0))) < 0.5 * characters


def stretch(ticks, first_time=0):
    """Frames of the samples at these milliseconds, each with its tick as counts."""
    return [encode(Sample(k % 65536, (first_time + 1000 * k) % 2**32, k, 0, 0)) for k in ticks]


def fed(stream, chunks, first_ns=0, step_ns=1_000_000):
    return [
        block
        for place, chunk in enumerate(chunks)
        for block in stream.feed(first_ns + place * step_ns, chunk)
        if block.channel == "force_raw"
    ]


@fixed
@given(st.lists(st.integers(1, 200_000), min_size=1, max_size=30), st.integers(0, 2**32 - 1))
def test_numbers_times_and_losses_are_right_over_every_wrap(gaps, first_time):
    ticks = np.cumsum([0, *gaps])
    stream = SampleStream()
    stream.feed(0, STARTED)
    blocks = [
        block
        for tick, frame in zip(ticks.tolist(), stretch(ticks.tolist(), first_time), strict=True)
        for block in stream.feed(tick * 1_000_000, frame)
        if block.channel == "force_raw"
    ]
    assert [block.first for block in blocks] == ticks.tolist()
    assert [int(block.device_ns[0]) for block in blocks] == [
        (first_time + 1000 * k) * 1000 for k in ticks.tolist()
    ]
    assert stream.counts().lost == ticks[-1] - len(gaps)


@fixed
@given(st.lists(st.integers(0, 2000)), st.sets(st.integers(0, 59), max_size=20))
def test_any_split_gives_the_same_samples(cuts, missing):
    kept = [tick for tick in range(60) if tick not in missing]
    bytes_ = STARTED + b"".join(stretch(kept))
    stream = SampleStream()
    blocks = fed(stream, pieces(bytes_, cuts))
    numbers = [block.first + place for block in blocks for place in range(len(block.values))]
    values = [value for block in blocks for value in block.raw]
    assert numbers == values == kept


def test_a_turn_of_the_clock_that_nobody_saw_is_known_from_the_bench():
    stream = SampleStream()
    hours_ns = 3 * 3600 * 1_000_000_000
    stream.feed(0, STARTED + b"".join(stretch([0])))
    (block, _) = stream.feed(hours_ns, b"".join(stretch([hours_ns // 1_000_000])))
    assert block.device_ns[0] == hours_ns
    assert stream.counts().lost == hours_ns // 1_000_000 - 1


def test_samples_count_from_start_to_stop_only():
    stream = SampleStream()
    stopped = encode(Acknowledgement(2, CONTRACT["commands"]["stop"], 0, 0))
    assert fed(stream, stretch(range(5))) == []
    assert fed(stream, [STARTED, *stretch(range(5)), stopped, *stretch(range(5, 9))])[-1].first == 4
    assert fed(stream, [STARTED, *stretch([3])])[0].first == 8
    assert stream.counts().lost == 3


def test_a_refused_start_starts_nothing():
    stream = SampleStream()
    refused = encode(Acknowledgement(1, CONTRACT["commands"]["start"], CONTRACT["codes"]["not_now"], 1000))
    assert fed(stream, [refused, *stretch(range(3))]) == []


@pytest.mark.parametrize(
    ("sample", "quality"),
    [
        (Sample(0, 0, 800, 80, CONTRACT["status"]["tared"] | CONTRACT["status"]["stable"]), "good"),
        (Sample(0, 0, 800, 0, CONTRACT["status"]["overload"]), "bad"),
        (Sample(0, 0, 800, 0, CONTRACT["status"]["sensor_fault"]), "bad"),
        (Sample(0, 0, 8_000_001, 0, 0), "bad"),
    ],
)
def test_status_and_range_make_the_quality(sample, quality):
    stream = SampleStream()
    force, force_raw = stream.feed(7, STARTED + encode(sample))
    assert (force.quality, force_raw.quality) == (quality, quality)
    assert force.values[0] == (sample.counts - sample.tare) / 800
    assert force_raw.values[0] == sample.counts / 800


def test_blocks_end_where_samples_are_missing_or_the_quality_changes():
    stream = SampleStream()
    bad = encode(Sample(4, 4000, 4, 0, CONTRACT["status"]["overload"]))
    blocks = fed(stream, [STARTED + b"".join([*stretch([0, 1, 3]), bad, *stretch([5, 6])])])
    assert [(block.first, len(block.values), block.quality) for block in blocks] == [
        (0, 2, "good"),
        (3, 1, "good"),
        (4, 1, "bad"),
        (5, 2, "good"),
    ]

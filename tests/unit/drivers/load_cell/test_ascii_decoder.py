from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.load_cell.ascii_decoder import AsciiLoadCellDecoder


def text(newtons, zero="GS", state="ST"):
    return f"{state},{zero},{newtons:+09.2f}"[:14].encode() + b"  N\r\n"


def decode(decoder, *pieces):
    blocks = [block for time, piece in enumerate(pieces) for block in decoder.feed(time, piece)]
    return [float(value) for block in blocks if block.channel == "force" for value in block.values]


def make_decoder(newtons=10.0, **options):
    """Return a decoder that has accepted two readings."""
    decoder = AsciiLoadCellDecoder(**options)
    decode(decoder, text(newtons), text(newtons))
    return decoder


@pytest.mark.parametrize(
    ("line", "newtons"),
    [
        (b"ST,GS,+0012.34 kg\r\n", 12.34 * 9.80665),
        (b"US,GS,-  2.500 kN\r\n", -2500.0),
        (b"ST,NT,+ 100.00 lb\n", 444.82216152605),
        (b"ST,GS,-0000050  N\r", -50.0),
    ],
)
def test_sign_value_and_unit_are_decoded(line, newtons):
    assert decode(make_decoder(newtons), line) == [pytest.approx(newtons)]


@pytest.mark.parametrize(
    "line",
    [
        b"ST,GS,+012.34 kg",
        b"ST,GS,+00012.34 kg",
        b"ST,GS,+0012.3  kg",
        b"ST,GS,+00.2.34 kg",
        b"ST,GS,+0012x34 kg",
        b"ST,GS, 0012.34 kg",
        b"ST,TR,+0012.34 kg",
        b"XX,GS,+0012.34 kg",
        b"ST,GS,+0012.34 mg",
        b"ST,GS,+0012.\xb34 kg",
        b"2.34 kg",
    ],
)
def test_any_other_format_is_refused_and_counted(line):
    decoder = make_decoder()
    assert decode(decoder, line + b"\r\n") == []
    assert decoder.corrupted == 1
    assert decode(decoder, text(10.0)) == [10.0]
    assert decoder.resynchronised == 1


@settings(derandomize=True, deadline=None)
@given(st.lists(st.integers(-40, 40), min_size=1, max_size=20), st.lists(st.integers(0, 400)))
def test_any_split_gives_the_same_readings(values, cuts):
    stream_bytes = b"".join(text(10.0 * value) for value in values)
    places = [0, *sorted(cut % (len(stream_bytes) + 1) for cut in cuts), len(stream_bytes)]
    pieces = [stream_bytes[a:b] for a, b in pairwise(places)]
    assert decode(make_decoder(), *pieces) == [10.0 * value for value in values]


@settings(derandomize=True, deadline=None)
@given(st.lists(st.tuples(st.binary(max_size=80), st.integers(-40, 40)), max_size=12))
def test_noise_between_lines_neither_hides_nor_makes_a_line(stretches):
    decoder = make_decoder()
    bytes_ = b"".join(noise + b"\r\n" + text(10.0 * value) for noise, value in stretches)
    assert decode(decoder, bytes_) == [10.0 * value for _, value in stretches]


@settings(derandomize=True, deadline=None)
@given(st.integers(0, 18), st.integers(1, 18))
def test_a_line_that_lost_characters_is_refused(start, length):
    line = text(4321.0)
    decoder = make_decoder(1234.0)
    values = decode(decoder, line[:start] + line[start + length :] + b"\r\n" + text(1234.0))
    assert values in ([1234.0], [4321.0, 1234.0])


def test_an_implausible_value_is_refused_until_the_next_agrees_with_it():
    decoder = make_decoder(10.0, max_step=100.0)
    assert decode(decoder, text(900.0), text(20.0), text(900.0), text(910.0)) == [20.0, 910.0]
    assert decoder.corrupted == 2


def test_a_value_out_of_range_is_always_refused():
    decoder = make_decoder(9900.0)
    assert decode(decoder, b"ST,GS,+0010100  N\r\n" * 3) == []
    assert decoder.corrupted == 3


def test_the_first_line_is_not_counted_as_corrupted():
    decoder = AsciiLoadCellDecoder()
    assert decode(decoder, b"034 kg\r\n", text(3.0), text(3.0)) == [3.0]
    assert (decoder.corrupted, decoder.resynchronised) == (0, 0)


def test_refused_lines_leave_a_gap_in_the_numbers():
    decoder = make_decoder()
    (before, _) = decoder.feed(1, text(10.0))
    (after, _) = decoder.feed(2, b"ST,GS,+00\r\n" + text(11.0))
    assert (before.first, after.first) == (2, 4)


def test_two_pieces_far_apart_in_time_are_not_joined():
    decoder = make_decoder()
    decoder.feed(0, text(10.0)[:10])
    assert decoder.feed(2_000_000_000, text(4000.0)[10:]) == []
    assert decoder.corrupted >= 1


def test_a_net_reading_gives_no_untared_force():
    decoder = make_decoder()
    blocks = decoder.feed(3, text(10.0) + text(0.0, "NT"))
    assert [block.channel for block in blocks] == ["force", "force_raw", "force"]
    assert {block.quality for block in blocks} == {"uncertain"}


def test_an_overload_is_a_lost_reading():
    decoder = make_decoder()
    assert decode(decoder, b"OL,GS,+-------  N\r\n") == []
    assert (decoder.overload, decoder.overload_count, decoder.corrupted) == (True, 1, 0)


def test_noise_without_line_ends_is_discarded():
    decoder = make_decoder()
    assert decode(decoder, bytes([65]) * 10_000, b"\r\n", text(10.0)) == [10.0]


@pytest.mark.parametrize(("pause_ns", "is_joined"), [(500_000_000, True), (500_000_001, False)])
def test_pieces_of_a_line_are_joined_within_half_a_second(pause_ns, is_joined):
    decoder = make_decoder()
    decoder.feed(10, text(10.0)[:10])
    assert bool(decoder.feed(10 + pause_ns, text(10.0)[10:])) is is_joined
    assert (decoder.corrupted > 0) is not is_joined


@pytest.mark.parametrize(("noise", "is_kept"), [(62, True), (63, False)])
def test_at_most_64_bytes_wait_for_their_line_end(noise, is_kept):
    decoder = make_decoder()
    decoder.feed(2, b"ST" + b"x" * noise)
    assert bytes.fromhex(decoder.snapshot()["buffer"]) == (b"ST" if is_kept else b"T") + b"x" * noise


@pytest.mark.parametrize(("newtons", "accepted"), [(110.0, True), (110.1, False), (-90.0, True), (-90.1, False)])
def test_a_step_up_to_the_limit_is_plausible(newtons, accepted):
    decoder = make_decoder(10.0, max_step=100.0)
    assert decode(decoder, text(newtons)) == ([newtons] if accepted else [])
    assert decoder.corrupted == (not accepted)

from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.ascii_load_cell_stream import ReadingStream


def text(newtons, zero="GS", state="ST"):
    return f"{state},{zero},{newtons:+09.2f}"[:14].encode() + b"  N\r\n"


def taken(stream, *pieces):
    blocks = [block for place, piece in enumerate(pieces) for block in stream.feed(place, piece)]
    return [float(value) for block in blocks if block.channel == "force" for value in block.values]


def begun(newtons=10.0, **options):
    """A stream that has two witnesses."""
    stream = ReadingStream(**options)
    taken(stream, text(newtons), text(newtons))
    return stream


@pytest.mark.parametrize(
    ("line", "newtons"),
    [
        (b"ST,GS,+0012.34 kg\r\n", 12.34 * 9.80665),
        (b"US,GS,-  2.500 kN\r\n", -2500.0),
        (b"ST,NT,+ 100.00 lb\n", 444.82216152605),
        (b"ST,GS,-0000050  N\r", -50.0),
    ],
)
def test_sign_value_and_unit_are_understood(line, newtons):
    assert taken(begun(newtons), line) == [pytest.approx(newtons)]


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
def test_any_other_form_is_refused_and_counted(line):
    stream = begun()
    assert taken(stream, line + b"\r\n") == []
    assert stream.corrupted == 1
    assert taken(stream, text(10.0)) == [10.0]
    assert stream.resynchronised == 1


@settings(derandomize=True, deadline=None)
@given(st.lists(st.integers(-40, 40), min_size=1, max_size=20), st.lists(st.integers(0, 400)))
def test_any_split_gives_the_same_readings(values, cuts):
    stream_bytes = b"".join(text(10.0 * value) for value in values)
    places = [0, *sorted(cut % (len(stream_bytes) + 1) for cut in cuts), len(stream_bytes)]
    pieces = [stream_bytes[a:b] for a, b in pairwise(places)]
    assert taken(begun(), *pieces) == [10.0 * value for value in values]


@settings(derandomize=True, deadline=None)
@given(st.lists(st.tuples(st.binary(max_size=80), st.integers(-40, 40)), max_size=12))
def test_noise_between_lines_hides_no_line_and_makes_none(stretches):
    stream = begun()
    bytes_ = b"".join(noise + b"\r\n" + text(10.0 * value) for noise, value in stretches)
    assert taken(stream, bytes_) == [10.0 * value for _, value in stretches]


@settings(derandomize=True, deadline=None)
@given(st.integers(0, 18), st.integers(1, 18))
def test_a_line_that_lost_characters_is_refused(place, length):
    line = text(4321.0)
    stream = begun(1234.0)
    values = taken(stream, line[:place] + line[place + length :] + b"\r\n" + text(1234.0))
    assert values in ([1234.0], [4321.0, 1234.0])


def test_a_wild_value_is_refused_until_the_next_agrees_with_it():
    stream = begun(10.0, wild_step=100.0)
    assert taken(stream, text(900.0), text(20.0), text(900.0), text(910.0)) == [20.0, 910.0]
    assert stream.corrupted == 2


def test_a_value_out_of_range_is_refused_for_good():
    stream = begun(9900.0)
    assert taken(stream, b"ST,GS,+0010100  N\r\n" * 3) == []
    assert stream.corrupted == 3


def test_the_first_line_has_no_witness_and_is_no_fault():
    stream = ReadingStream()
    assert taken(stream, b"034 kg\r\n", text(3.0), text(3.0)) == [3.0]
    assert (stream.corrupted, stream.resynchronised) == (0, 0)


def test_refused_lines_leave_a_gap_in_the_numbers():
    stream = begun()
    (before, _) = stream.feed(1, text(10.0))
    (after, _) = stream.feed(2, b"ST,GS,+00\r\n" + text(11.0))
    assert (before.first, after.first) == (2, 4)


def test_two_pieces_that_lie_apart_in_time_are_no_line():
    stream = begun()
    stream.feed(0, text(10.0)[:10])
    assert stream.feed(2_000_000_000, text(4000.0)[10:]) == []
    assert stream.corrupted >= 1


def test_a_net_reading_gives_no_untared_force():
    stream = begun()
    blocks = stream.feed(3, text(10.0) + text(0.0, "NT"))
    assert [block.channel for block in blocks] == ["force", "force_raw", "force"]
    assert {block.quality for block in blocks} == {"uncertain"}


def test_an_overload_is_a_lost_reading():
    stream = begun()
    assert taken(stream, b"OL,GS,+-------  N\r\n") == []
    assert (stream.overload, stream.overloaded, stream.corrupted) == (True, 1, 0)


def test_endless_noise_is_not_kept():
    stream = begun()
    assert taken(stream, bytes([65]) * 10_000, b"\r\n", text(10.0)) == [10.0]

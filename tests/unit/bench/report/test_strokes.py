"""Choice of strokes for a plot, on motions whose cycles are known."""

import numpy as np
import pytest

from bench.log import LoggedSegment
from bench.report.recording import Recording
from bench.report.strokes import choose_strokes

RATE = 100.0


def make_recording(displacement, segments=(), drive=None):
    count = len(displacement)
    return Recording(
        time=np.arange(count) / RATE,
        displacement=np.asarray(displacement, float),
        velocity=np.gradient(displacement) * RATE,
        drive=np.linspace(0, 1, count) if drive is None else drive,
        force=np.zeros(count),
        simulated=None,
        held_out=None,
        segments=tuple(segments),
        drive_unit="V",
    )


def make_segment(start, stop, drive_value=0.5, motion="sine", amplitude=0.01, frequency=1.0, drive="constant"):
    return LoggedSegment(0, "a", "s", motion, drive, amplitude, frequency, drive_value, start, stop)


def make_sine(count, phase=-0.01 * np.pi, frequency=1.0):
    """Return a sine of 10 mm; by default it rises half a sample after its start, and not at a sample."""
    return 0.01 * np.sin(2 * np.pi * frequency * np.arange(count) / RATE + phase)


def choose(displacement, *segments, **options):
    return choose_strokes(make_recording(displacement, segments), **options)


def test_last_two_of_five_cycles_and_the_last_one_as_loop_are_shown():
    trace = choose(make_sine(601), make_segment(100, 601))[0].traces[0]
    assert (trace.rows, trace.loop, trace.drive) == (slice(401, 601), slice(500, 601), 0.5)


@pytest.mark.parametrize(("samples", "rows"), [(251, slice(1, 202)), (199, slice(1, 199)), (150, slice(1, 102))])
def test_cycles_are_counted_from_the_first_rise_and_a_nearly_complete_one_counts(samples, rows):
    assert choose(make_sine(600), make_segment(0, samples))[0].traces[0].rows == rows


def test_cycles_begin_where_the_motion_rises_through_its_mean():
    shifted = 0.02 + make_sine(401, phase=0.49 * np.pi)  # rises 0.755 s after its start
    assert choose(shifted, make_segment(0, 401))[0].traces[0].rows == slice(176, 377)


def test_a_drive_that_is_rounded_to_zero_has_no_sign():
    trace = choose(make_sine(600), make_segment(0, 600, drive_value=-1e-4))[0].traces[0]
    assert str(trace.drive) == "0.0"


@pytest.mark.parametrize(("samples", "is_cut"), [(103, False), (105, True)])
def test_a_stroke_of_at_most_one_cycle_is_shown_whole(samples, is_cut):
    trace = choose(make_sine(600), make_segment(0, samples))[0].traces[0]
    assert (trace.rows != trace.loop) == is_cut


@pytest.mark.parametrize(("samples", "motion", "title"), [
    (50, "sine", "middle of the recording"),
    (51, "sine", "sine, 10 mm, 1 Hz"),
    (200, "hold", "middle of the recording"),
    (200, "other", "middle of the recording"),
])  # fmt: skip
def test_rests_and_segments_of_at_most_50_samples_are_not_strokes(samples, motion, title):
    assert choose(make_sine(600), make_segment(0, samples, motion=motion))[0].title == title


@pytest.mark.parametrize(
    ("changes", "count"),
    [
        ({"drive_value": 0.1}, 1),
        ({"drive_value": 0.1, "amplitude": 0.0119}, 1),
        ({"drive_value": 0.1, "amplitude": 0.0121}, 2),
        ({"drive_value": 0.1, "frequency": 0.84}, 1),
        ({"drive_value": 0.1, "frequency": 0.82}, 2),
        ({"drive_value": 0.1, "amplitude": None}, 2),
        ({"drive_value": None}, 2),
        ({"drive_value": 0.1, "motion": "triangle"}, 2),
    ],
)
def test_segments_whose_sizes_differ_by_at_most_a_fifth_are_one_stroke(changes, count):
    first, second = make_segment(0, 300), make_segment(300, 600, **changes)
    assert len(choose(make_sine(600), first, second)) == count


def test_at_each_drive_the_longest_segment_is_shown_in_order_of_drives():
    """Drives are rounded to 0.01 V, a fiftieth of the range of 1 V rounded down to a power of ten."""
    segments = [make_segment(0, 300, 0.502), make_segment(300, 700, 0.498), make_segment(700, 900, 0.0)]
    traces = choose(make_sine(900), *segments)[0].traces
    assert [trace.drive for trace in traces] == [0.0, 0.5]
    assert traces[1].rows == slice(501, 700)


def test_title_gives_the_varying_drive_and_omits_unknown_sizes():
    varying = make_segment(0, 300, None, "random", None, None, "prbs")
    assert choose(make_sine(300), varying)[0].title == "random, drive prbs"


@pytest.mark.parametrize(
    ("frequency", "samples", "rows"),
    [(1.0, 1001, slice(300, 700)), (1.0, 301, slice(0, 300)), (10.0, 1001, slice(450, 551))],
)
def test_without_segments_four_seconds_or_ten_cycles_in_the_middle_are_shown(frequency, samples, rows):
    found = choose(make_sine(samples, 0.3, frequency))[0].traces[0].rows
    assert (found.start, found.stop) == pytest.approx((rows.start, rows.stop), abs=3)


def test_slowest_fastest_and_middle_are_shown_of_the_strokes_with_at_least_half_the_drives():
    sizes = [(0.01, frequency, 3) for frequency in (3.0, 1.0, 5.0, 2.0, 4.0)] + [(0.01, 9.0, 2), (0.001, 1.0, 1)]
    segments, parts = [], []
    for amplitude, frequency, drives in sizes:
        for drive in (0.1, 0.3, 0.5)[:drives]:
            start = 300 * len(segments)
            segments.append(make_segment(start, start + 300, drive, amplitude=amplitude, frequency=frequency))
            parts.append(100 * amplitude * make_sine(300, frequency=frequency))
    recording = make_recording(np.concatenate(parts), segments)
    titles = [[stroke.title for stroke in choose_strokes(recording, limit)] for limit in (2, 3)]
    assert titles[0] == ["sine, 10 mm, 1 Hz", "sine, 10 mm, 9 Hz"]
    assert titles[1] == ["sine, 10 mm, 1 Hz", "sine, 10 mm, 3 Hz", "sine, 10 mm, 9 Hz"]

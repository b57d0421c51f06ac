import dataclasses

import numpy as np
import pytest

from bench.errors import ReportError
from bench.log.reader import read_log
from bench.report import plots
from bench.report.drawing import (
    MAX_POINTS,
    DriveColours,
    compute_plot_envelope,
    decimate,
    draw_envelope,
    make_figure,
)
from bench.report.recording import make_recording
from bench.report.strokes import choose_strokes
from tests.support.reports import CYCLES, prediction, series, write_log


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    return read_log(write_log(tmp_path_factory.mktemp("report") / "run.mcap"))


@pytest.fixture(scope="module")
def recording(log):
    return make_recording(log, series(held_out=True))


def test_segments_find_their_samples_on_the_time_base_of_the_series(log):
    late = {name: array[100:] for name, array in series().arrays.items()}
    found = make_recording(log, dataclasses.replace(series(), arrays=late))
    assert [(s.start, s.stop) for s in found.segments] == [(0, 900), (900, 1900), (1900, 2900)]


def test_one_stroke_shows_its_constant_drives_and_another_the_varying_one(recording):
    constant, varying = choose_strokes(recording)
    assert [trace.drive for trace in constant.traces] == [0.1, 0.3]
    assert varying.has_varying_drive
    assert varying.title == "sine, 10 mm, 2 Hz, drive steps"


def test_a_loop_shows_one_cycle_and_a_plot_over_time_two(recording):
    trace = choose_strokes(recording)[0].traces[0]
    assert trace.loop.stop - trace.loop.start == pytest.approx(250, abs=2)
    assert trace.rows.stop - trace.rows.start == pytest.approx(500, abs=2)
    assert recording.displacement[trace.rows.start] == pytest.approx(0.0, abs=3e-4)
    assert recording.velocity[trace.rows.start] > 0
    assert trace.rows.start >= (CYCLES - 3) * 250


def test_without_segments_the_middle_of_the_recording_is_shown(recording):
    (middle,) = choose_strokes(dataclasses.replace(recording, segments=()))
    rows = middle.traces[0].rows
    assert recording.time[rows].mean() == pytest.approx(3.0, abs=0.01)
    assert rows.stop - rows.start == 2000


def test_a_fast_motion_is_shown_for_a_shorter_time(recording):
    fast = np.sin(2 * np.pi * 40 * recording.time)
    (middle,) = choose_strokes(dataclasses.replace(recording, segments=(), displacement=fast))
    rows = middle.traces[0].rows
    assert np.ptp(recording.time[rows]) == pytest.approx(0.25, abs=0.02)


def test_of_many_strokes_the_slowest_and_the_fastest_are_among_those_shown(recording):
    one = recording.segments[0]
    segments = tuple(dataclasses.replace(one, amplitude=0.01 * 2**k, start=one.start + k) for k in range(6))
    assert len(choose_strokes(dataclasses.replace(recording, segments=segments), limit=3)) == 3


def test_a_drive_has_the_same_colour_in_every_plot(recording):
    colours = DriveColours.from_recording(recording)
    assert colours.get_colour(0.1) != colours.get_colour(0.3)
    first = plots.plot_error_by_drive(prediction().per_drive, 1.9, recording).axes[0].patches[0]
    assert first.get_facecolor()[:3] == pytest.approx(colours.get_colour(0.10003))


def test_no_line_has_more_than_the_largest_number_of_points():
    for length in (10, MAX_POINTS, 50_001):
        kept = np.arange(length)[decimate(slice(0, length))]
        assert len(kept) <= MAX_POINTS
        assert kept[0] == 0


def test_an_envelope_keeps_the_extremes_and_does_not_extend_over_a_gap():
    time = np.concatenate([np.arange(1000) * 1e-3, 5 + np.arange(1000) * 1e-3])
    values = np.sin(40 * time)
    values[777] = 9.0
    found = compute_plot_envelope(time, values, time, bins=7)
    assert found.high.max() == 9.0
    assert found.low.min() == values.min()
    assert not np.any((found.time > 1.0) & (found.time < 5.0))


def test_a_constant_drive_is_drawn_as_a_line_with_gaps():
    time = np.concatenate([np.arange(1000) * 1e-3, 5 + np.arange(1000) * 1e-3])
    axes = make_figure(4.0, 3.0).subplots()
    draw_envelope(axes, compute_plot_envelope(time, np.full(2000, 0.3), time, bins=20), "black")
    _, line = axes.collections
    steps = np.array([np.ptp(path.vertices[:, 0]) for path in line.get_paths()])
    assert steps.sum() == pytest.approx(1.8, abs=0.1)
    assert steps.max() < 0.2


@pytest.mark.parametrize(("draw", "labels"), [
    (plots.plot_loops, ("displacement [mm]", "velocity [m/s]", "force [N]")),
    (plots.plot_over_time, ("time [s]", "force [N]")),
    (plots.plot_recording, ("displacement [mm]", "drive [V]", "force [N]", "time [s]")),
])  # fmt: skip
def test_every_axis_has_its_unit(recording, draw, labels):
    axes = draw(recording).axes
    texts = {axis.get_xlabel() for axis in axes} | {axis.get_ylabel() for axis in axes}
    assert set(labels) <= texts
    assert all("[" in label for label in texts if label)


def test_the_residual_is_drawn_with_the_floor_and_the_held_out_part(recording):
    figure = plots.plot_residual(recording, 1.9)
    texts = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert texts == ["± twice the noise floor", "held out of the fit"]


def test_there_is_no_residual_without_a_fit(log):
    with pytest.raises(ReportError, match="give the report a fit"):
        plots.plot_residual(make_recording(log, None), 1.9)


def test_a_log_without_a_shown_channel_is_refused_by_its_name(log):
    without = {name: values for name, values in log.samples.items() if name != "force"}
    with pytest.raises(ReportError, match=r"run\.mcap: the samples have no channel 'force'"):
        make_recording(dataclasses.replace(log, samples=without), None)


def test_plots_are_saved_as_png_and_svg(recording, tmp_path):
    plots.save_figures({"whole": plots.plot_recording(recording)}, tmp_path / "plots")
    assert (tmp_path / "plots" / "whole.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (tmp_path / "plots" / "whole.svg").read_text()


def test_plots_that_cannot_be_saved_give_one_message(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ReportError, match="plots cannot be written"):
        plots.save_figures({}, tmp_path / "file")


def test_a_segment_shorter_than_a_cycle_is_shown_as_it_is(recording):
    short = dataclasses.replace(recording.segments[0], stop=recording.segments[0].start + 60)
    (stroke, *_) = choose_strokes(dataclasses.replace(recording, segments=(short,)))
    rows = stroke.traces[0].rows
    assert (rows.start, rows.stop) == (short.start, short.stop)

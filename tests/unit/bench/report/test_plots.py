import dataclasses

import numpy as np
import pytest

from bench.errors import ReportError
from bench.log.reader import read_log
from bench.report import plots, save_figures
from bench.report.drawing import (
    MAX_POINTS,
    DriveColours,
    compute_plot_envelope,
    decimate,
    draw_envelope,
    lighten,
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
    save_figures({"whole": plots.plot_recording(recording)}, tmp_path / "plots")
    assert (tmp_path / "plots" / "whole.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (tmp_path / "plots" / "whole.svg").read_text()


def test_plots_that_cannot_be_saved_give_one_message(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ReportError, match="plots cannot be written"):
        save_figures({}, tmp_path / "file")


def test_a_segment_shorter_than_a_cycle_is_shown_as_it_is(recording):
    short = dataclasses.replace(recording.segments[0], stop=recording.segments[0].start + 60)
    (stroke, *_) = choose_strokes(dataclasses.replace(recording, segments=(short,)))
    rows = stroke.traces[0].rows
    assert (rows.start, rows.stop) == (short.start, short.stop)


def get_lines(axes):
    return [(line.get_xdata(), line.get_ydata()) for line in axes.get_lines()]


def test_loops_are_drawn_in_millimetres_and_metres_per_second(recording):
    constant = choose_strokes(recording)[0]
    rows = constant.traces[0].loop
    left, right = plots.plot_loops(recording).axes[:2]
    for axes, values in ((left, 1000 * recording.displacement[rows]), (right, recording.velocity[rows])):
        (x, simulated), (_, recorded) = get_lines(axes)[:2]
        np.testing.assert_allclose(x, values)
        np.testing.assert_array_equal(simulated, recording.simulated[rows])
        np.testing.assert_array_equal(recorded, recording.force[rows])


def test_the_cycles_of_all_drives_start_at_time_zero(recording):
    figure = plots.plot_over_time(recording)
    constant, varying = figure.axes[:2]
    assert [line[0][0] for line in get_lines(constant)] == [0.0] * 4
    assert [axes.get_xlabel() for axes in (constant, varying)] == [
        "time from the start of the cycles [s]",
        "time [s]",
    ]
    assert varying.get_title(loc="left").startswith("sine, 10 mm, 2 Hz, drive steps, from ")


def test_the_whole_recording_is_drawn_in_millimetres(recording):
    displacement = plots.plot_recording(recording).axes[0]
    low, high = displacement.dataLim.intervaly
    assert (low, high) == pytest.approx((-10, 10), abs=0.01)


def test_the_residual_is_simulated_minus_recorded_force_with_a_band_of_twice_the_floor(recording):
    biased = dataclasses.replace(recording, simulated=recording.force + 5.0)
    axes = plots.plot_residual(biased, 1.5).axes[0]
    band, held_out = axes.patches
    assert (band.get_y(), band.get_height()) == (-3.0, 6.0)
    assert (held_out.get_x(), held_out.get_width()) == pytest.approx((3.0, 2.998))
    assert axes.collections[1].get_paths()[0].vertices[0][1] == pytest.approx(5.0)


@pytest.mark.parametrize("held_out", [(), (0, 3000)])
def test_nothing_is_marked_as_held_out_if_none_or_all_of_it_is(recording, held_out):
    mask = np.zeros(3000, bool)
    mask[slice(*held_out) if held_out else slice(0, 0)] = True
    axes = plots.plot_residual(dataclasses.replace(recording, held_out=mask), 1.5).axes[0]
    assert len(axes.patches) == 1


def test_bars_of_the_error_by_drive_keep_the_width_of_one_of_six(recording):
    axes = plots.plot_error_by_drive(prediction().per_drive, 1.9, recording).axes[0]
    assert axes.get_xlim() == pytest.approx((-0.7, 5.7))
    assert axes.get_ylim() == pytest.approx((0, 1.25 * 2.2))
    assert [label.get_text() for label in axes.get_xticklabels()] == ["0.1 V", "0.3 V"]
    assert plots.plot_error_by_drive(prediction().per_drive, 4.0, recording).axes[0].get_ylim()[1] == 5.0


@pytest.mark.parametrize(("length", "step"), [(1, 1), (2000, 1), (2001, 2), (4000, 2), (4001, 3)])
def test_points_are_left_out_only_above_the_largest_number(length, step):
    assert decimate(slice(7, 7 + length)) == slice(7, 7 + length, step)


def test_an_envelope_has_the_extremes_mean_time_and_middle_drive_of_each_bin():
    time = np.array([0.0, 1, 2, 3, 4, 5, 6])
    found = compute_plot_envelope(time, time**2, 10 * time, bins=3)
    assert found.rows.tolist() == [0, 3, 6]
    assert found.time.tolist() == [1.0, 4.0, 6.0]
    assert (found.low.tolist(), found.high.tolist()) == ([0, 9, 36], [4, 25, 36])
    assert found.drive.tolist() == [10, 40, 60]
    assert compute_plot_envelope(time, time, time).rows.tolist() == [0, 1, 2, 3, 4, 5, 6]


@pytest.mark.parametrize(("gap", "rows"), [(9.0, [0, 4]), (11.0, [0, 3, 4])])
def test_a_bin_ends_at_a_gap_of_more_than_ten_samples(gap, rows):
    time = np.array([0.0, 1, 2, 2 + gap, 3 + gap, 4 + gap, 5 + gap])
    assert compute_plot_envelope(time, time, time, bins=2).rows.tolist() == rows


def test_equal_drives_have_a_finite_colour_scale():
    colours = DriveColours(0.2, 0.2, "V")
    assert all(np.isfinite(colours.get_colour(0.2)))
    assert colours.scale.norm.vmax > colours.scale.norm.vmin
    assert colours.scale.norm.vmax == pytest.approx(0.2, abs=1e-6)


def test_a_recorded_line_is_lighter_by_45_percent_of_white():
    assert lighten((0.0, 0.4, 1.0)) == pytest.approx((0.45, 0.67, 1.0))


@pytest.mark.parametrize(("first", "expected"), [(0.0, (0, 1000)), (0.0019, (1, 1000)), (3.0, (0, 0))])
def test_a_segment_keeps_its_samples_on_a_later_time_base(log, first, expected):
    arrays = {name: array[series().arrays["time"] >= first] for name, array in series().arrays.items()}
    found = make_recording(log, dataclasses.replace(series(), arrays=arrays)).segments[0]
    assert found.stop - found.start == expected[1] - expected[0]

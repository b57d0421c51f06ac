"""Plots of a recording and of a fit on it, as separate figures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from bench.errors import ReportError
from bench.report.documents import DriveError
from bench.report.drawing import (
    FAINT_COLOUR,
    INK_COLOUR,
    DriveColours,
    compute_plot_envelope,
    decimate,
    draw_colour_bar,
    draw_envelope,
    draw_legend,
    draw_pair,
    draw_varying,
    make_figure,
    style_axes,
)
from bench.report.recording import Array, Recording
from bench.report.strokes import Stroke, Trace, choose_strokes
from bench.report.values import format_drive

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DISPLACEMENT, VELOCITY, FORCE = "displacement [mm]", "velocity [m/s]", "force [N]"


def plot_loops(recording: Recording) -> Figure:
    """Plot force against displacement and against velocity, one row per stroke."""

    def draw(axes: Sequence[Axes], stroke: Stroke, colours: DriveColours) -> None:
        columns = ((1e3, recording.displacement, DISPLACEMENT), (1.0, recording.velocity, VELOCITY))
        for ax, (scale, values, label) in zip(axes, columns, strict=True):
            for trace in stroke.traces:
                rows = decimate(trace.loop)
                _draw_trace(ax, recording, trace, rows, scale * values[rows], colours)
            style_axes(ax, label, FORCE, stroke.title if ax is axes[0] else "")

    return _plot_strokes(recording, 2, 3.6, draw)


def plot_over_time(recording: Recording) -> Figure:
    """Plot force against time, with the cycles at all drives overlaid, one row per stroke."""

    def draw(axes: Sequence[Axes], stroke: Stroke, colours: DriveColours) -> None:
        for trace in stroke.traces:
            rows = decimate(trace.rows)
            time = recording.time[rows]
            _draw_trace(axes[0], recording, trace, rows, time - time[0], colours)
        first = recording.time[stroke.traces[0].rows.start]
        start = "" if len(stroke.traces) > 1 else f", from {first:.2f} s of the recording"
        style_axes(
            axes[0],
            "time from the start of the cycles [s]" if not start else "time [s]",
            FORCE,
            stroke.title + start,
        )

    return _plot_strokes(recording, 1, 2.9, draw)


def plot_recording(recording: Recording) -> Figure:
    """Plot displacement, drive and force of the whole recording."""
    figure = make_figure(9.0, 4.8)
    rows = figure.subplots(3, 1, sharex=True)
    colours = DriveColours.from_recording(recording)
    channels = (
        (1e3 * recording.displacement, DISPLACEMENT),
        (recording.drive, colours.label),
        (recording.force, FORCE),
    )
    for axes, (values, label) in zip(rows, channels, strict=True):
        draw_envelope(axes, compute_plot_envelope(recording.time, values, recording.drive), colours)
        style_axes(axes, "time [s]" if axes is rows[-1] else "", label)
    return figure


def plot_residual(recording: Recording, floor: float) -> Figure:
    """Plot simulated minus recorded force over the whole recording; ``floor`` is the noise floor [N].

    Raises:
        ReportError: the recording has no simulated force.
    """
    if recording.simulated is None:
        raise ReportError("a plot of the force error needs a simulated force; give the report a fit")
    figure = make_figure(9.0, 2.7)
    axes = figure.subplots()
    axes.axhspan(
        -2 * floor, 2 * floor, color=FAINT_COLOUR, alpha=0.6, linewidth=0, label="± twice the noise floor"
    )
    envelope = compute_plot_envelope(recording.time, recording.simulated - recording.force, recording.drive)
    colours = DriveColours.from_recording(recording)
    draw_envelope(axes, envelope, colours)
    _mark_held_out(axes, recording)
    style_axes(axes, "time [s]", "simulated − recorded [N]")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), fontsize=8, frameon=False, ncols=2)
    draw_colour_bar(figure, [axes], colours.scale, colours.label)
    return figure


def plot_error_by_drive(errors: Sequence[DriveError], floor: float, recording: Recording) -> Figure:
    """Plot the force error at each drive as bars, with the noise floor [N]."""
    figure = make_figure(9.0, 2.7)
    axes = figure.subplots()
    colours = DriveColours.from_recording(recording)
    span = float(np.ptp([e.drive for e in errors]))
    ticks = np.arange(len(errors))
    axes.bar(ticks, [e.rmse_n for e in errors], width=0.6, color=[colours.get_colour(e.drive) for e in errors])
    axes.axhline(floor, color=INK_COLOUR, linewidth=1.2, linestyle=(0, (4, 3)), label=f"noise floor {floor:.3g} N")
    axes.set_xticks(ticks, [f"{format_drive(e.drive, span)} {e.unit}" for e in errors])
    axes.set_xlim(-0.7, max(len(errors), 6) - 0.3)
    axes.set_ylim(0, 1.25 * max([floor, *(e.rmse_n for e in errors)]))
    style_axes(axes, "drive", "force error, RMSE [N]")
    axes.grid(visible=False, axis="x")
    axes.legend(loc="upper right", fontsize=8.5, frameon=False)
    return figure


def _plot_strokes(
    recording: Recording,
    columns: int,
    height: float,
    draw: Callable[[Sequence[Axes], Stroke, DriveColours], None],
) -> Figure:
    """Make a figure with a row for each stroke, a legend of constant drives, and a colour bar for varying ones."""
    strokes, colours = choose_strokes(recording), DriveColours.from_recording(recording)
    figure = make_figure(9.0, height * len(strokes) + 0.4)
    grid = figure.subplots(len(strokes), columns, squeeze=False)
    for axes, stroke in zip(grid, strokes, strict=True):
        draw(list(axes), stroke, colours)
        if stroke.has_varying_drive:
            draw_colour_bar(figure, list(axes), colours.scale, colours.label)
    drives = sorted({trace.drive for stroke in strokes for trace in stroke.traces if trace.drive is not None})
    labels = [(drive, f"{format_drive(drive, colours.high - colours.low)} {colours.unit}") for drive in drives]
    draw_legend(figure, colours, labels, recording.simulated is not None)
    return figure


def _draw_trace(
    axes: Axes, recording: Recording, trace: Trace, rows: slice, x: Array, colours: DriveColours
) -> None:
    simulated = None if recording.simulated is None else recording.simulated[rows]
    if trace.drive is None:
        draw_varying(axes, x, recording.force[rows], simulated, recording.drive[rows], colours)
    else:
        draw_pair(axes, x, recording.force[rows], simulated, colours.get_colour(trace.drive))


def _mark_held_out(axes: Axes, recording: Recording) -> None:
    """Shade the held-out samples, if a part of the recording was held out."""
    held_out = recording.held_out
    if held_out is None or held_out.all() or not held_out.any():
        return
    edges = np.flatnonzero(np.diff(np.concatenate([[False], held_out, [False]]).astype(int)))
    for number, (start, stop) in enumerate(edges.reshape(-1, 2)):
        label = "held out of the fit" if number == 0 else None
        first, last = recording.time[start], recording.time[stop - 1]
        axes.axvspan(first, last, color="#7fa8d6", alpha=0.18, linewidth=0, label=label)

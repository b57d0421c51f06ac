"""The report's pictures, each as a figure of its own; nothing is kept between them."""

from collections.abc import Callable, Sequence
from functools import lru_cache
from io import BytesIO
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bench.errors import ReportError
from bench.report.documents import DriveError
from bench.report.drawing import (
    FAINT,
    INK,
    DriveColours,
    colour_bar,
    draw_envelope,
    draw_pair,
    draw_varying,
    envelope,
    legend,
    new_figure,
    style,
    thinned,
)
from bench.report.recording import Array, Recording
from bench.report.strokes import Stroke, Trace, choose_strokes
from bench.report.values import level

DISPLACEMENT, VELOCITY, FORCE = "displacement [mm]", "velocity [m/s]", "force [N]"


def loops(recording: Recording) -> Figure:
    """Force against displacement and against velocity, one row a stroke."""

    def draw(axes: Sequence[Axes], stroke: Stroke, colours: DriveColours) -> None:
        across = ((1e3, recording.displacement, DISPLACEMENT), (1.0, recording.velocity, VELOCITY))
        for ax, (scale, values, label) in zip(axes, across, strict=True):
            for trace in stroke.traces:
                rows = thinned(trace.loop)
                _draw(ax, recording, trace, rows, scale * values[rows], colours)
            style(ax, label, FORCE, stroke.title if ax is axes[0] else "")

    return _by_stroke(recording, 2, 3.6, draw)


def over_time(recording: Recording) -> Figure:
    """Force against time, cycles at several drives laid upon each other, one row a stroke."""

    def draw(axes: Sequence[Axes], stroke: Stroke, colours: DriveColours) -> None:
        for trace in stroke.traces:
            rows = thinned(trace.rows)
            time = recording.time[rows]
            _draw(axes[0], recording, trace, rows, time - time[0], colours)
        first = recording.time[stroke.traces[0].rows.start]
        start = "" if len(stroke.traces) > 1 else f", from {first:.2f} s of the recording"
        style(
            axes[0],
            "time from the start of the cycles [s]" if not start else "time [s]",
            FORCE,
            stroke.title + start,
        )

    return _by_stroke(recording, 1, 2.9, draw)


def whole(recording: Recording) -> Figure:
    """Displacement, drive and force of the whole recording."""
    figure = new_figure(9.0, 4.8)
    rows = figure.subplots(3, 1, sharex=True)
    colours = DriveColours.of_recording(recording)
    drawn = (
        (1e3 * recording.displacement, DISPLACEMENT),
        (recording.drive, colours.label),
        (recording.force, FORCE),
    )
    for axes, (values, label) in zip(rows, drawn, strict=True):
        draw_envelope(axes, envelope(recording.time, values, recording.drive), colours)
        style(axes, "time [s]" if axes is rows[-1] else "", label)
    return figure


def residual(recording: Recording, floor: float) -> Figure:
    """Simulated minus recorded force over the whole recording; ``floor`` is the noise of the force [N].

    Raises:
        ReportError: the recording has no simulated force.
    """
    if recording.simulated is None:
        raise ReportError("no residual without a simulated force; give the report a fit")
    figure = new_figure(9.0, 2.7)
    axes = figure.subplots()
    axes.axhspan(-2 * floor, 2 * floor, color=FAINT, alpha=0.6, linewidth=0, label="± twice the noise floor")
    found = envelope(recording.time, recording.simulated - recording.force, recording.drive)
    colours = DriveColours.of_recording(recording)
    draw_envelope(axes, found, colours)
    _mark_held_out(axes, recording)
    style(axes, "time [s]", "simulated − recorded [N]")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), fontsize=8, frameon=False, ncols=2)
    colour_bar(figure, [axes], colours.scale, colours.label)
    return figure


def by_drive(errors: Sequence[DriveError], floor: float, recording: Recording) -> Figure:
    """Force error at each drive as bars beside the noise floor [N]."""
    figure = new_figure(9.0, 2.7)
    axes = figure.subplots()
    colours = DriveColours.of_recording(recording)
    span = float(np.ptp([e.drive for e in errors]))
    places = np.arange(len(errors))
    axes.bar(places, [e.rmse_n for e in errors], width=0.6, color=[colours.of(e.drive) for e in errors])
    axes.axhline(floor, color=INK, linewidth=1.2, linestyle=(0, (4, 3)), label=f"noise floor {floor:.3g} N")
    axes.set_xticks(places, [f"{level(e.drive, span)} {e.unit}" for e in errors])
    axes.set_xlim(-0.7, max(len(errors), 6) - 0.3)
    axes.set_ylim(0, 1.25 * max([floor, *(e.rmse_n for e in errors)]))
    style(axes, "drive", "force error, RMSE [N]")
    axes.grid(visible=False, axis="x")
    axes.legend(loc="upper right", fontsize=8.5, frameon=False)
    return figure


@lru_cache(maxsize=16)
def png(figure: Figure, dpi: int = 160) -> bytes:
    """A figure as PNG, fine enough for a dense screen; drawn once for the page and for the file."""
    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=dpi, metadata={"Software": "mrbench"})
    # Finding the layout takes as long as drawing, and it is the same for the SVG.
    figure.set_layout_engine("none")
    return buffer.getvalue()


def save(figures: dict[str, Figure], folder: Path) -> None:
    """Write every figure as SVG and PNG under its name.

    Raises:
        ReportError: the folder cannot be written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        # Without salt and date the same picture would be another file each time.
        with matplotlib.rc_context({"svg.hashsalt": "mrbench"}):
            for name, figure in figures.items():
                (folder / f"{name}.png").write_bytes(png(figure))
                figure.savefig(folder / f"{name}.svg", format="svg", metadata={"Date": None})
    except OSError as error:
        raise ReportError(f"{folder}: plots cannot be written there ({error.strerror}); choose another") from error


def _by_stroke(
    recording: Recording,
    columns: int,
    height: float,
    draw: Callable[[Sequence[Axes], Stroke, DriveColours], None],
) -> Figure:
    """A figure with a row for each stroke, a legend of the constant drives and a bar for varying ones."""
    strokes, colours = choose_strokes(recording), DriveColours.of_recording(recording)
    figure = new_figure(9.0, height * len(strokes) + 0.4)
    grid = figure.subplots(len(strokes), columns, squeeze=False)
    for axes, stroke in zip(grid, strokes, strict=True):
        draw(list(axes), stroke, colours)
        if stroke.varying:
            colour_bar(figure, list(axes), colours.scale, colours.label)
    drives = sorted({trace.drive for stroke in strokes for trace in stroke.traces if trace.drive is not None})
    labels = [(drive, f"{level(drive, colours.high - colours.low)} {colours.unit}") for drive in drives]
    legend(figure, colours, labels, recording.simulated is not None)
    return figure


def _draw(
    axes: Axes, recording: Recording, trace: Trace, rows: slice, across: Array, colours: DriveColours
) -> None:
    simulated = None if recording.simulated is None else recording.simulated[rows]
    if trace.drive is None:
        draw_varying(axes, across, recording.force[rows], simulated, recording.drive[rows], colours)
    else:
        draw_pair(axes, across, recording.force[rows], simulated, colours.of(trace.drive))


def _mark_held_out(axes: Axes, recording: Recording) -> None:
    """Shade what the fit did not see, where it saw the rest."""
    held = recording.held_out
    if held is None or held.all() or not held.any():
        return
    edges = np.flatnonzero(np.diff(np.concatenate([[False], held, [False]]).astype(int)))
    for number, (start, stop) in enumerate(edges.reshape(-1, 2)):
        label = "held out of the fit" if number == 0 else None
        first, last = recording.time[start], recording.time[stop - 1]
        axes.axvspan(first, last, color="#7fa8d6", alpha=0.18, linewidth=0, label=label)

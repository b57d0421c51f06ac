"""Plots of a campaign: each parameter over the runs of a specimen, with intervals, drift, outliers, remounts."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice, pairwise
from math import floor, log10
from typing import TYPE_CHECKING

from bench.campaign_report.content import CampaignReport, Cell, Series
from bench.campaign_report.results import MAX_PICTURES, name_picture
from bench.report import FAINT_COLOUR, INK_COLOUR, format_unit, make_figure, style_axes
from bench.report.layout import Picture, render_png

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLUMNS = 3
_WIDTH, _HEIGHT = 9.0, 1.75
"""[inch] Width of a figure, and height of one row of axes."""
_VALUE_COLOUR, _DRIFT_COLOUR, _OUTLIER_COLOUR = "#2f6db5", "#6b7480", "#c04b2d"
_DASHES = (0, (4, 3))
_CAPTION = (
    "Points: values with 95 % intervals; hollow: no interval. Dashed: drift, where it can be told."
    " Diamond: outlier. Dotted: remount."
)


def make_pictures(report: CampaignReport) -> dict[str, Picture]:
    """Make the plots of all cells with at least two identified runs, by the names that the sections use."""
    drawn = ((name_picture(number), cell, plot_cell(cell)) for number, cell in enumerate(report.cells))
    figures = ((name, cell, figure) for name, cell, figure in drawn if figure is not None)
    return {
        name: Picture(f"Parameters over the campaign: {cell.title}", _CAPTION, render_png(figure))
        for name, cell, figure in islice(figures, MAX_PICTURES)
    }


def plot_cell(cell: Cell) -> Figure | None:
    """Plot each parameter of a cell over time; None with fewer than two identified runs."""
    shown = [one for one in cell.series if len(one.runs) > 1]
    if not shown:
        return None
    rows = -(-len(shown) // _COLUMNS)
    figure = make_figure(_WIDTH, _HEIGHT * rows + 0.5)
    grid = figure.subplots(rows, _COLUMNS, squeeze=False, sharex=True)
    places = list(grid.flat)
    for axes, one in zip(places, shown, strict=False):
        _draw_series(axes, one)
    for axes in places[len(shown) :]:
        axes.set_visible(False)
    _label_time(places, len(shown))
    _draw_legend(figure, shown)
    return figure


def _draw_series(axes: Axes, one: Series) -> None:
    scale, power = _choose_scale(one.values)
    for hour, run, value, half in zip(one.hours, one.runs, one.values, one.half_widths, strict=True):
        colour = _OUTLIER_COLOUR if run in one.outliers else _VALUE_COLOUR
        axes.errorbar(
            hour,
            value / scale,
            yerr=None if half is None else half / scale,
            fmt="D" if run in one.outliers else "o",
            color=colour,
            markerfacecolor="none" if half is None else colour,
            markersize=4.5,
            linewidth=1.0,
        )
    if (line := one.drift_per_hour) is not None:
        ends = (one.hours[0], one.hours[-1])
        values = [line.evaluate(hour) / scale for hour in ends]
        axes.plot(ends, values, color=_DRIFT_COLOUR, linestyle=_DASHES, linewidth=1.0)
    _mark_remounts(axes, one)
    style_axes(axes, "", "", f"{one.trend.parameter} [{power}{format_unit(one.trend.unit)}]")


def _choose_scale(values: Sequence[float]) -> tuple[float, str]:
    """Return the power of ten in which values are plotted, as a number and as text for the unit."""
    size = max(map(abs, values))
    power = 3 * floor(log10(size) / 3) if size > 0 else 0
    return (10.0**power, f"$10^{{{power}}}$ ") if power >= 6 or power < 0 else (1.0, "")


def _mark_remounts(axes: Axes, one: Series) -> None:
    """Mark the middle between two runs in different mountings."""
    for (before, first), (after, second) in pairwise(zip(one.hours, one.mountings, strict=True)):
        if first != second:
            axes.axvline((before + after) / 2, color=INK_COLOUR, linestyle=":", linewidth=1.0)


def _label_time(places: Sequence[Axes], shown: int) -> None:
    """Label the lowest axes of each column."""
    for axes in places[max(0, shown - _COLUMNS) : shown]:
        axes.set_xlabel("time since the start [h]", color=INK_COLOUR, fontsize=9)
        axes.tick_params(labelbottom=True)


def _draw_legend(figure: Figure, shown: Sequence[Series]) -> None:
    """Draw one legend above all axes, with what the plot contains."""
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], color=_VALUE_COLOUR, marker="o", linestyle="", label="run with 95 % interval")]
    if any(one.drift_per_hour for one in shown):
        handles.append(Line2D([], [], color=_DRIFT_COLOUR, linestyle=_DASHES, label="drift"))
    if any(one.outliers for one in shown):
        handles.append(Line2D([], [], color=_OUTLIER_COLOUR, marker="D", linestyle="", label="outlier"))
    if any(len(set(one.mountings)) > 1 for one in shown):
        handles.append(Line2D([], [], color=INK_COLOUR, linestyle=":", label="remount"))
    figure.legend(handles=handles, loc="outside upper center", ncols=len(handles), frameon=False, fontsize=8.5,
                  labelcolor=INK_COLOUR, edgecolor=FAINT_COLOUR)  # fmt: skip

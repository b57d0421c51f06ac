"""Elements of the plots: colours by drive, pairs of recorded and simulated lines, envelopes of many samples.

Matplotlib is imported by the functions that draw: service and worker read results at once, and never draw.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from bench.report.recording import Array, Recording

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

Colour = tuple[float, float, float]

INK_COLOUR, FAINT_COLOUR = "#33393f", "#d5d9de"
MAX_POINTS = 2000
"""Largest number of points of one line."""
_WHITE_SHARE = 0.45
"""Share of white in the colour of a recorded line."""


@dataclass(frozen=True)
class DriveColours:
    """One colour for each drive, the same in all plots of a report."""

    low: float
    """[V or A]"""
    high: float
    """[V or A]"""
    unit: str

    @classmethod
    def from_recording(cls, recording: Recording) -> DriveColours:
        """Return the colours for the drives of a recording."""
        low, high = np.percentile(recording.drive, [0.2, 99.8])
        return cls(float(low), float(high), recording.drive_unit)

    @property
    def label(self) -> str:
        """Label of the colour bar."""
        return f"drive [{self.unit}]"

    @property
    def scale(self) -> ScalarMappable:
        """Mapping from drive to colour."""
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize

        spread = max(self.high - self.low, 1e-9)
        return ScalarMappable(Normalize(self.low, self.low + spread), _make_drive_colourmap())

    def get_colour(self, drive: float) -> Colour:
        """Return the colour of one drive [V or A]."""
        red, green, blue, _ = np.asarray(self.scale.to_rgba(np.array([drive])))[0]
        return float(red), float(green), float(blue)


@cache
def _make_drive_colourmap() -> ListedColormap:
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    return ListedColormap(colormaps["plasma"](np.linspace(0.0, 0.82, 256)), "drives")


def lighten(colour: Colour) -> Colour:
    """Return the colour of a recorded line next to a simulated one."""
    red, green, blue = (_WHITE_SHARE + (1 - _WHITE_SHARE) * part for part in colour)
    return red, green, blue


def make_figure(width: float, height: float) -> Figure:
    """Return an empty figure of a size [inch]."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained", facecolor="white")


def draw_bars(axes: Axes, rows: Sequence[tuple[str, float, str]], x_label: str) -> None:
    """Draw horizontal bars from top to bottom, each with name, length and colour."""
    for row, (_, length, colour) in enumerate(rows):
        axes.barh(row, length, height=0.55, color=colour)
    axes.set_yticks(range(len(rows)), [name for name, _, _ in rows])
    axes.invert_yaxis()
    style_axes(axes, x_label, "")
    axes.grid(visible=False, axis="y")


def style_axes(axes: Axes, x_label: str, y_label: str, title: str = "") -> None:
    """Set labels, grid, colours and font sizes of axes."""
    axes.set_xlabel(x_label, color=INK_COLOUR, fontsize=9)
    axes.set_ylabel(y_label, color=INK_COLOUR, fontsize=9)
    axes.tick_params(colors=INK_COLOUR, labelsize=8, length=3)
    axes.grid(color=FAINT_COLOUR, linewidth=0.5)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(FAINT_COLOUR)
    if title:
        axes.set_title(title, loc="left", color=INK_COLOUR, fontsize=10)


def decimate(rows: slice) -> slice:
    """Return a slice with a step, so that a line has at most ``MAX_POINTS``."""
    return slice(rows.start, rows.stop, max(1, -(-(rows.stop - rows.start) // MAX_POINTS)))


def draw_pair(axes: Axes, x: Array, recorded: Array, simulated: Array | None, colour: Colour) -> None:
    """Draw the recorded force as a thin light line over the simulated force; without one, as a normal line."""
    if simulated is None:
        axes.plot(x, recorded, color=colour, linewidth=1.1)
        return
    axes.plot(x, simulated, color=colour, linewidth=2.4, solid_joinstyle="round")
    axes.plot(x, recorded, color=lighten(colour), linewidth=0.8)


def draw_varying(
    axes: Axes, x: Array, recorded: Array, simulated: Array | None, drive: Array, colours: DriveColours
) -> None:
    """Draw a pair whose colour follows a varying drive."""
    rgb = np.asarray(colours.scale.to_rgba(drive))[:, :3]
    if simulated is not None:
        _draw_coloured_line(axes, x, simulated, rgb, 2.4)
        rgb = _WHITE_SHARE + (1 - _WHITE_SHARE) * rgb
    _draw_coloured_line(axes, x, recorded, rgb, 1.1 if simulated is None else 0.8)
    axes.autoscale_view()


def _draw_coloured_line(axes: Axes, x: Array, y: Array, rgb: npt.NDArray[np.floating], width: float) -> None:
    from matplotlib.collections import LineCollection

    points = np.stack([x, y], axis=1)
    lines = np.stack([points[:-1], points[1:]], axis=1)
    axes.add_collection(LineCollection(list(lines), colors=list(rgb[:-1]), linewidths=width, capstyle="round"))


def draw_legend(
    figure: Figure, colours: DriveColours, drives: Sequence[tuple[float, str]], has_simulation: bool
) -> None:
    """Draw one legend above all axes: recorded and simulated lines, and the drives.

    Args:
        figure: figure to draw on.
        colours: colours by drive.
        drives: constant drives with their labels.
        has_simulation: whether a simulated force is drawn.
    """
    if handles := _make_legend_handles(colours, drives, has_simulation):
        figure.legend(
            handles=handles, loc="outside upper center", ncols=min(len(handles), 8), frameon=False, fontsize=8.5
        )


def _make_legend_handles(
    colours: DriveColours, drives: Sequence[tuple[float, str]], has_simulation: bool
) -> list[Line2D]:
    from matplotlib.lines import Line2D

    handles: list[Line2D] = []
    if has_simulation:
        handles.append(Line2D([], [], color="#b9bec4", linewidth=0.8, label="recorded"))
        handles.append(Line2D([], [], color="#5b636b", linewidth=2.4, label="simulated"))
    return handles + [
        Line2D([], [], color=colours.get_colour(drive), linewidth=2.4, label=label) for drive, label in drives
    ]


def draw_colour_bar(figure: Figure, axes: Sequence[Axes], scale: ScalarMappable, label: str) -> None:
    """Draw a colour bar next to axes; the label contains quantity and unit."""
    bar = figure.colorbar(scale, ax=list(axes), fraction=0.03, pad=0.01)
    bar.set_label(label, color=INK_COLOUR, fontsize=9)
    bar.ax.tick_params(colors=INK_COLOUR, labelsize=8, length=2)
    bar.outline.set_visible(False)


@dataclass(frozen=True)
class PlotEnvelope:
    """Lowest and highest value of each bin of many samples; arrays have shape (bins,)."""

    time: Array
    """Mean time of the bin [s]."""
    low: Array
    """Lowest value, in the unit of the samples."""
    high: Array
    """Highest value, in the unit of the samples."""
    drive: Array
    """Drive in the middle of the bin [V or A]."""
    rows: npt.NDArray[np.int64]
    """First sample of the bin."""


def compute_plot_envelope(time: Array, values: Array, drive: Array, bins: int = 900) -> PlotEnvelope:
    """Compute the envelope of values (N,); no bin extends over a gap in time."""
    step = max(1, -(-len(time) // bins))
    breaks = np.flatnonzero(np.diff(time) > 10 * float(np.median(np.diff(time)))) + 1
    rows = np.unique(np.concatenate([np.arange(0, len(time), step), breaks])).astype(np.int64)
    counts = np.diff(np.append(rows, len(time)))
    return PlotEnvelope(
        time=np.add.reduceat(time, rows) / counts,
        low=np.minimum.reduceat(values, rows),
        high=np.maximum.reduceat(values, rows),
        drive=np.asarray(drive[rows + counts // 2]),
        rows=rows,
    )


def draw_envelope(axes: Axes, envelope: PlotEnvelope, colours: DriveColours | str) -> None:
    """Draw an envelope as vertical lines in colours by drive or one colour, with a line through their middles."""
    from matplotlib.collections import LineCollection

    low, high = np.stack([envelope.time, envelope.low], 1), np.stack([envelope.time, envelope.high], 1)
    line_colours = colours if isinstance(colours, str) else list(colours.scale.to_rgba(envelope.drive))
    verticals = list(np.stack([low, high], axis=1))
    axes.add_collection(LineCollection(verticals, colors=line_colours, linewidths=0.9, capstyle="projecting"))
    # A line without height is not drawn, so that a constant drive would be invisible.
    axes.add_collection(LineCollection(list(_connect_middles(envelope)), colors=line_colours, linewidths=0.9))
    axes.autoscale_view()


def _connect_middles(envelope: PlotEnvelope) -> Array:
    """Return lines between the middles of successive bins, shape (bins, 2, 2); before a gap in time, a point."""
    points = np.stack([envelope.time, (envelope.low + envelope.high) / 2], axis=1)
    following = np.roll(points, -1, axis=0)
    steps = np.diff(envelope.time)
    has_gap = np.append(steps > 3 * np.median(steps), True) if len(steps) else np.ones(1, bool)
    return np.stack([points, np.where(has_gap[:, None], points, following)], axis=1)

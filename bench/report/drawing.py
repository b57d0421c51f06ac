"""How the pictures look: colours by drive, recorded beside simulated lines, envelopes of many samples."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from bench.report.recording import Array, Recording

Colour = tuple[float, float, float]

INK, FAINT = "#33393f", "#d5d9de"
MOST_POINTS = 2000
"""Drawn of one line."""
_DRIVES = ListedColormap(colormaps["plasma"](np.linspace(0.0, 0.82, 256)), "drives")
_LIGHT = 0.45
"""[1] how far a recorded line is mixed with white."""


@dataclass(frozen=True)
class DriveColours:
    """One colour for each drive, the same in every picture of a report."""

    low: float
    """[V or A]"""
    high: float
    """[V or A]"""
    unit: str

    @classmethod
    def of_recording(cls, recording: Recording) -> "DriveColours":
        """The colours for the drives of a recording."""
        low, high = np.percentile(recording.drive, [0.2, 99.8])
        return cls(float(low), float(high), recording.drive_unit)

    @property
    def label(self) -> str:
        """What the colours mean, with unit."""
        return f"drive [{self.unit}]"

    @property
    def scale(self) -> ScalarMappable:
        """Drive to colour, also for a colour bar."""
        spread = max(self.high - self.low, 1e-9)
        return ScalarMappable(Normalize(self.low, self.low + spread), _DRIVES)

    def of(self, drive: float) -> Colour:
        """The colour of one drive [V or A]."""
        red, green, blue, _ = np.asarray(self.scale.to_rgba(np.array([drive])))[0]
        return float(red), float(green), float(blue)


def light(colour: Colour) -> Colour:
    """The colour of a recorded line beside the simulated one."""
    red, green, blue = (_LIGHT + (1 - _LIGHT) * part for part in colour)
    return red, green, blue


def new_figure(width: float, height: float) -> Figure:
    """An empty picture [inch]."""
    return Figure(figsize=(width, height), layout="constrained", facecolor="white")


def bars(axes: Axes, rows: Sequence[tuple[str, float, str]], across: str) -> None:
    """Lying bars in calm axes, the first on top; each with its name, length and colour."""
    for place, (_, length, colour) in enumerate(rows):
        axes.barh(place, length, height=0.55, color=colour)
    axes.set_yticks(range(len(rows)), [name for name, _, _ in rows])
    axes.invert_yaxis()
    style(axes, across, "")
    axes.grid(visible=False, axis="y")


def style(axes: Axes, across: str, up: str, title: str = "") -> None:
    """Calm axes with units in their labels."""
    axes.set_xlabel(across, color=INK, fontsize=9)
    axes.set_ylabel(up, color=INK, fontsize=9)
    axes.tick_params(colors=INK, labelsize=8, length=3)
    axes.grid(color=FAINT, linewidth=0.5)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(FAINT)
    if title:
        axes.set_title(title, loc="left", color=INK, fontsize=10)


def thinned(rows: slice) -> slice:
    """Every so-manieth sample, so that a line has at most ``MOST_POINTS``."""
    return slice(rows.start, rows.stop, max(1, -(-(rows.stop - rows.start) // MOST_POINTS)))


def draw_pair(axes: Axes, across: Array, recorded: Array, simulated: Array | None, colour: Colour) -> None:
    """The recorded force, thin and light, over the simulated one, strong; alone it is drawn strong."""
    if simulated is None:
        axes.plot(across, recorded, color=colour, linewidth=1.1)
        return
    axes.plot(across, simulated, color=colour, linewidth=2.4, solid_joinstyle="round")
    axes.plot(across, recorded, color=light(colour), linewidth=0.8)


def draw_varying(
    axes: Axes, across: Array, recorded: Array, simulated: Array | None, drive: Array, colours: DriveColours
) -> None:
    """The same for a drive that varies along the line."""
    rgb = np.asarray(colours.scale.to_rgba(drive))[:, :3]
    if simulated is not None:
        _coloured_line(axes, across, simulated, rgb, 2.4)
        rgb = _LIGHT + (1 - _LIGHT) * rgb
    _coloured_line(axes, across, recorded, rgb, 1.1 if simulated is None else 0.8)
    axes.autoscale_view()


def _coloured_line(axes: Axes, across: Array, up: Array, rgb: npt.NDArray[np.floating], width: float) -> None:
    points = np.stack([across, up], axis=1)
    pieces = np.stack([points[:-1], points[1:]], axis=1)
    axes.add_collection(LineCollection(list(pieces), colors=list(rgb[:-1]), linewidths=width, capstyle="round"))


def legend(figure: Figure, colours: DriveColours, drives: Sequence[tuple[float, str]], paired: bool) -> None:
    """One legend above all axes: what is recorded and simulated, and the drives.

    Args:
        figure: the picture.
        colours: by drive.
        drives: constant drives with their label.
        paired: whether a simulated force is drawn.
    """
    handles: list[Line2D] = []
    if paired:
        handles.append(Line2D([], [], color="#b9bec4", linewidth=0.8, label="recorded"))
        handles.append(Line2D([], [], color="#5b636b", linewidth=2.4, label="simulated"))
    handles += [Line2D([], [], color=colours.of(drive), linewidth=2.4, label=label) for drive, label in drives]
    if handles:
        figure.legend(
            handles=handles, loc="outside upper center", ncols=min(len(handles), 8), frameon=False, fontsize=8.5
        )


def colour_bar(figure: Figure, axes: Sequence[Axes], scale: ScalarMappable, label: str) -> None:
    """What the colours mean, beside the axes that show them; the label gives quantity and unit."""
    bar = figure.colorbar(scale, ax=list(axes), fraction=0.03, pad=0.01)
    bar.set_label(label, color=INK, fontsize=9)
    bar.ax.tick_params(colors=INK, labelsize=8, length=2)
    bar.outline.set_visible(False)


@dataclass(frozen=True)
class Envelope:
    """Many samples as the lowest and highest of each of a few bins; arrays (bins,)."""

    time: Array
    """[s] middle of the bin."""
    low: Array
    """In the unit of the samples."""
    high: Array
    """In the unit of the samples."""
    drive: Array
    """[V or A] middle drive of the bin."""
    rows: npt.NDArray[np.int64]
    """First sample of the bin."""


def envelope(time: Array, values: Array, drive: Array, bins: int = 900) -> Envelope:
    """The envelope of values (N,); no bin reaches over a gap in time."""
    step = max(1, -(-len(time) // bins))
    breaks = np.flatnonzero(np.diff(time) > 10 * float(np.median(np.diff(time)))) + 1
    rows = np.unique(np.concatenate([np.arange(0, len(time), step), breaks])).astype(np.int64)
    counts = np.diff(np.append(rows, len(time)))
    return Envelope(
        time=np.add.reduceat(time, rows) / counts,
        low=np.minimum.reduceat(values, rows),
        high=np.maximum.reduceat(values, rows),
        drive=np.asarray(drive[rows + counts // 2]),
        rows=rows,
    )


def draw_envelope(axes: Axes, found: Envelope, colours: DriveColours | str) -> None:
    """An envelope as upright strokes, coloured by drive or in one colour, and a line through their middles."""
    ends = np.stack([np.stack([found.time, found.low], 1), np.stack([found.time, found.high], 1)], axis=1)
    each = colours if isinstance(colours, str) else list(colours.scale.to_rgba(found.drive))
    axes.add_collection(LineCollection(list(ends), colors=each, linewidths=0.9, capstyle="projecting"))
    # A stroke without height is not drawn: a constant drive would not be seen at all.
    axes.add_collection(LineCollection(list(_middles(found)), colors=each, linewidths=0.9))
    axes.autoscale_view()


def _middles(found: Envelope) -> Array:
    """(bins, 2, 2) from the middle of each bin to that of the next one; a point where time has a gap behind it."""
    points = np.stack([found.time, (found.low + found.high) / 2], axis=1)
    after = np.roll(points, -1, axis=0)
    steps = np.diff(found.time)
    apart = np.append(steps > 3 * np.median(steps), True) if len(steps) else np.ones(1, bool)
    return np.stack([points, np.where(apart[:, None], points, after)], axis=1)

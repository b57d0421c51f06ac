"""Figures 3 to 5 of the paper: force over time, displacement and velocity at six voltages."""

from collections.abc import Callable
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.common import PredictionSeries

matplotlib.use("Agg")

_CYCLE_TIME = 1.0
"""Time shown at each voltage [s]."""
_END_MARGIN = 5.0
"""Time between the end of the shown cycle and the end of its voltage [s]."""
_DOT_SPACING = 12
"""Distance between two dots of the recorded force [samples]."""


def draw(series: PredictionSeries, folder: Path) -> None:
    """Write the three figures into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    axes_by_name: dict[str, tuple[str, Callable[[np.ndarray], np.ndarray]]] = {
        "force_time": ("time in the cycle [s]", lambda rows: series.time[rows] - series.time[rows[0]]),
        "force_displacement": ("displacement [mm]", lambda rows: 1e3 * series.displacement[rows]),
        "force_velocity": ("velocity [m/s]", lambda rows: series.velocity[rows]),
    }
    cycles = _find_cycles(series)
    colours = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.88, len(cycles)))
    for name, (label, values) in axes_by_name.items():
        figure = Figure(figsize=(6.4, 4.2), layout="constrained")
        axes = figure.subplots()
        for (drive, rows), colour in zip(cycles.items(), colours, strict=True):
            axes.plot(values(rows), series.simulated[rows], color=colour, lw=1.1, label=f"{abs(drive):.1f} V")
            thin = rows[::_DOT_SPACING]
            axes.plot(values(rows)[::_DOT_SPACING], series.force[thin], ".", color=colour, ms=3.0)
        _format_axes(axes, label)
        figure.savefig(folder / f"{name}.png", dpi=90, metadata={"Software": None})


def _find_cycles(series: PredictionSeries) -> dict[float, np.ndarray]:
    """Return the indices of one late cycle at each voltage."""
    rate = 1.0 / float(np.median(np.diff(series.time[:1000])))
    levels = np.round(series.drive, 1)
    found = {}
    for drive in np.unique(levels):
        last = np.flatnonzero(levels == drive)[-1] - round(_END_MARGIN * rate)
        found[float(drive)] = np.arange(last - round(_CYCLE_TIME * rate), last)
    return found


def _format_axes(axes: Axes, label: str) -> None:
    axes.set_xlabel(label)
    axes.set_ylabel("force [N]")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(title="dots recorded, lines predicted", frameon=False, fontsize=8, title_fontsize=8)

"""Plots of the real dampers: recorded force, simulated force and residual."""

from collections.abc import Iterable
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.common import POINTS, Cycles, PredictionSeries, find_cycles

matplotlib.use("Agg")

_CURRENTS = ("0", "0.25", "0.5", "0.75", "1")
_COLOURS = dict(zip(_CURRENTS, matplotlib.colormaps["viridis"](np.linspace(0.0, 0.88, 5)), strict=True))
_EXCERPT = (18.0, 18.8)
"""Interval of the random stroke that is plotted over time [s]."""


def draw_all(utfsm: PredictionSeries, nees: PredictionSeries, folder: Path) -> None:
    """Write all plots into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    figures = {
        "loops-5mm-4hz": plot_loops(utfsm, "5mm_4Hz"),
        "loops-25mm-0.5hz": plot_loops(utfsm, "25mm_0.5Hz"),
        "residual-over-phase": plot_residuals(utfsm, ("5mm_4Hz", "25mm_0.5Hz")),
        "notch": plot_notch(utfsm, ("5mm_4Hz_1A", "25mm_0.5Hz_1A")),
        "random-stroke": plot_time_series(nees),
    }
    for name, figure in figures.items():
        figure.savefig(folder / f"{name}.png", dpi=90, metadata={"Software": None})


def plot_loops(series: PredictionSeries, stroke: str) -> Figure:
    """Plot the force over displacement and velocity, as mean of the steady cycles, for all currents."""
    figure = Figure(figsize=(9.0, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    for current in _CURRENTS:
        cycles = find_cycles(series, f"{stroke}_{current}A")
        for axes, across in ((left, 1e3 * cycles.displacement), (right, cycles.velocity)):
            _plot_pair(axes, across.mean(axis=0), cycles, current)
    _format_axes(left, "displacement [mm]", "force [N]", f"held out: {stroke.replace('_', ', ')}")
    _format_axes(right, "velocity [m/s]", "", "line: recorded, dashed: simulated")
    right.legend(title="current", frameon=False, fontsize=8)
    return figure


def plot_residuals(series: PredictionSeries, strokes: Iterable[str]) -> Figure:
    """Plot recorded minus simulated force over the phase of the stroke, as mean of the steady cycles."""
    figure = Figure(figsize=(9.0, 3.8), layout="constrained")
    degree = 360.0 * np.arange(POINTS) / POINTS
    for axes, stroke in zip(figure.subplots(1, 2, sharey=True), strokes, strict=True):
        for current in _CURRENTS:
            common = find_cycles(series, f"{stroke}_{current}A").mean_residual
            axes.plot(degree, common, color=_COLOURS[current], lw=1.1, label=f"{current} A")
        for reversal in (90, 270):
            axes.axvline(reversal, color="0.8", lw=0.8, zorder=0)
        axes.set_xticks(range(0, 361, 90))
        _format_axes(axes, "phase of the stroke [degree]", "recorded - simulated [N]", stroke.replace("_", ", "))
    figure.axes[1].legend(frameon=False, fontsize=8)
    return figure


def plot_notch(series: PredictionSeries, names: Iterable[str]) -> Figure:
    """Plot the force of all steady cycles around the lower reversal at the highest current."""
    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    degree = 360.0 * np.arange(POINTS) / POINTS
    near = (degree > 240) & (degree < 340)
    for axes, name in zip(figure.subplots(1, 2, sharey=True), names, strict=True):
        cycles = find_cycles(series, name)
        axes.plot(degree[near], cycles.force.T[near], color=_COLOURS["1"], lw=0.6)
        axes.plot(degree[near], cycles.simulated.mean(axis=0)[near], color="0.2", lw=1.2, ls="--")
        axes.axvline(270, color="0.8", lw=0.8, zorder=0)
        _format_axes(
            axes, "phase of the stroke [degree]", "force [N]", f"{name.replace('_', ', ')}: every steady cycle"
        )
    return figure


def plot_time_series(series: PredictionSeries) -> Figure:
    """Plot force, residual, displacement and voltage of the held-out part of the random stroke."""
    figure = Figure(figsize=(9.0, 6.0), layout="constrained")
    force, residual, motion, drive = figure.subplots(4, 1, sharex=True, height_ratios=(3, 1.6, 1, 1))
    rows = (series.time >= _EXCERPT[0]) & (series.time < _EXCERPT[1]) & series.held_out
    time = series.time[rows]
    force.plot(time, series.force[rows], color="tab:blue", lw=1.0, label="recorded")
    force.plot(time, series.simulated[rows], color="0.2", lw=0.9, ls="--", label="simulated")
    force.legend(frameon=False, fontsize=8, ncols=2)
    residual.plot(time, series.residual[rows], color="tab:red", lw=0.8)
    motion.plot(time, 1e3 * series.displacement[rows], color="0.3", lw=0.9)
    drive.plot(time, series.drive[rows], color="0.3", lw=0.9)
    _format_axes(force, "", "force [N]", "random stroke, held-out part")
    _format_axes(residual, "", "recorded -\nsimulated [N]", "")
    _format_axes(motion, "", "displacement\n[mm]", "")
    _format_axes(drive, "time [s]", "voltage [V]", "")
    return figure


def _plot_pair(axes: Axes, across: np.ndarray, cycles: Cycles, current: str) -> None:
    colour = _COLOURS[current]
    axes.plot(across, cycles.force.mean(axis=0), color=colour, lw=1.2, label=f"{current} A")
    axes.plot(across, cycles.simulated.mean(axis=0), color=colour, lw=1.0, ls=(0, (3, 2)))


def _format_axes(axes: Axes, across: str, up: str, title: str) -> None:
    axes.set_xlabel(across)
    axes.set_ylabel(up)
    axes.set_title(title, fontsize=9)
    axes.grid(color="0.93", lw=0.6)
    axes.spines[["top", "right"]].set_visible(False)

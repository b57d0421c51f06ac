"""Plots of a diagnosis: force errors, probabilities of the stages, gap map, curves outside the library."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from bench.report.diagnosis import Diagnosis, MapPoint, join_names
from bench.report.discovery import DiscoveredCurve, get_quantity, get_variable_unit
from bench.report.drawing import INK_COLOUR, draw_bars, draw_colour_bar, make_figure, style_axes
from bench.report.values import format_name, format_significant, format_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.image import AxesImage

_GAP_COLOUR, _REMAINDER_COLOUR, _PALE_COLOUR = "#b5473c", "#3f7d58", "#c9ced4"
_LABEL_BOX = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
"""Background of a label, which the line of the noise floor may cross."""
_PHASE_BINS = 8
"""Number of phases of a cycle in the gap map."""
_MAX_ROWS = 18
"""Largest number of conditions in the gap map; those with the largest gap are shown."""

Numbers = npt.NDArray[np.float64]


def plot_shrinkage(diagnosis: Diagnosis) -> Figure:
    """Plot the force errors on held-out strokes with and without the effects, and the stages' probabilities."""
    figure = make_figure(9.0, 2.9)
    left, right = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
    _draw_errors(left, diagnosis)
    _draw_stages(right, diagnosis)
    return figure


def plot_gap_map(diagnosis: Diagnosis, drive_unit: str) -> Figure | None:
    """Plot the gap by condition and phase of the stroke; None without a gap or without repeated cycles.

    Args:
        diagnosis: content of a diagnosis.
        drive_unit: V or A.
    """
    if diagnosis.verdict == "no_gap":
        return None
    periodic = [point for point in diagnosis.where.map if point.frequency_hz > 0]
    rows, grid = _group_by_condition(periodic, drive_unit)
    if not rows:
        return None
    figure = make_figure(9.0, 1.3 + 0.24 * len(rows))
    axes = figure.subplots()
    image = _draw_gap_map(axes, rows, grid)
    draw_colour_bar(figure, [axes], image, "gap beyond the noise [N]")
    return figure


def plot_discovery(diagnosis: Diagnosis, drive_unit: str) -> Figure | None:
    """Plot the curves of the effects outside the library with their 95 % bands; None without any.

    Args:
        diagnosis: content of a diagnosis.
        drive_unit: V or A.
    """
    if diagnosis.discovery is None:
        return None
    curves = diagnosis.discovery.all_curves
    figure = make_figure(9.0, 3.1)
    for axes, found in zip(figure.subplots(1, len(curves), squeeze=False)[0], curves, strict=True):
        _draw_curve(axes, found, drive_unit)
    return figure


def _draw_curve(axes: Axes, found: DiscoveredCurve, drive_unit: str) -> None:
    curve = found.curve
    x_scale, x_unit = _scale_length(get_variable_unit(curve.variable, drive_unit))
    y_scale, y_unit = _scale_length(format_unit(curve.unit.replace("{drive}", drive_unit)))
    x = x_scale * np.array(curve.x)
    if curve.lo is not None and curve.hi is not None:
        low, high = y_scale * np.array(curve.lo), y_scale * np.array(curve.hi)
        axes.fill_between(x, low, high, color=_PALE_COLOUR, alpha=0.6, linewidth=0)
    axes.plot(x, y_scale * np.array(curve.value), color=_GAP_COLOUR, linewidth=1.6)
    style_axes(
        axes,
        f"{'time since a change' if found.is_step_response else format_name(curve.variable)} [{x_unit}]",
        f"{get_quantity(found, drive_unit)} [{y_unit}]",
        found.label.replace(" over ", "\nover ", 1),
    )
    if found.is_step_response:
        axes.set_xscale("log")
    else:
        axes.locator_params(axis="x", nbins=6)


def _scale_length(unit: str) -> tuple[float, str]:
    """Return the factor and the unit in which values are plotted; lengths in millimetres as in all plots."""
    return (1e3, "mm") if unit == "m" else (1.0, unit)


def _draw_gap_map(axes: Axes, rows: Sequence[str], grid: Numbers) -> AxesImage:
    image = axes.imshow(grid, aspect="auto", cmap="OrRd", vmin=0.0, interpolation="nearest")
    axes.set_yticks(range(len(rows)), rows)
    phases = ["extension, fastest", "end", "compression, fastest", "end", "extension"]
    axes.set_xticks(np.arange(0, _PHASE_BINS + 1, 2) - 0.5, phases)
    style_axes(axes, "phase of the stroke", "")
    axes.grid(visible=False)
    return image


def _list_errors(diagnosis: Diagnosis) -> list[tuple[str, float, str]]:
    """Return label, size [N] and colour of each error, in the order of the bars."""
    gap = diagnosis.gap
    law_colour = _REMAINDER_COLOUR if diagnosis.verdict == "no_gap" else _GAP_COLOUR
    errors = [("refitted law", gap.before_n, law_colour)]
    if gap.nominal_n is not None:
        errors.insert(0, ("given simulation", gap.nominal_n, _GAP_COLOUR))
    if diagnosis.effects:
        named = join_names([effect.name for effect in diagnosis.effects]).replace(" and ", "\nand ")
        errors.append((f"with {named}", gap.after_n, _REMAINDER_COLOUR))
    if diagnosis.discovery is not None:
        errors.append(("with the effect\noutside the library", diagnosis.discovery.rmse_n, _REMAINDER_COLOUR))
    return errors


def _draw_errors(axes: Axes, diagnosis: Diagnosis) -> None:
    errors = _list_errors(diagnosis)
    draw_bars(axes, errors, "force error on held-out strokes, RMSE [N]; dashed: noise floor")
    for row, (_, size, _) in enumerate(errors):
        axes.annotate(
            f"{format_significant(size)} N",
            (size, row),
            xytext=(6, 0),
            textcoords="offset points",
            va="center",
            fontsize=8.5,
            color=INK_COLOUR,
            bbox=_LABEL_BOX,
        )
    axes.axvline(diagnosis.gap.noise_floor_n, color=INK_COLOUR, linewidth=1.2, linestyle=(0, (4, 3)))
    axes.set_ylim(max(len(errors), 2) - 0.5, -0.5)  # a single bar has the width of one of two
    axes.set_xlim(0, 1.25 * max(size for _, size, _ in errors))


def _draw_stages(axes: Axes, diagnosis: Diagnosis) -> None:
    bars = [
        (format_name(stage), probability, _GAP_COLOUR if probability > 0.5 else _PALE_COLOUR)
        for stage, probability in diagnosis.where.stages.items()
    ]
    draw_bars(axes, bars, "probability of a missing effect")
    axes.set_xlim(0, 1)


def _group_by_condition(points: Sequence[MapPoint], drive_unit: str) -> tuple[list[str], Numbers]:
    """Return the names of the conditions with the largest gap, and the gap [N], shape (conditions, phases)."""
    gaps: dict[tuple[float, float, float], Numbers] = {}
    for point in points:
        row = gaps.setdefault((point.amplitude_m, point.frequency_hz, point.drive), np.zeros(_PHASE_BINS))
        row[int(point.phase * _PHASE_BINS) % _PHASE_BINS] = point.gap_n
    largest = sorted(gaps, key=lambda key: -float(np.sum(gaps[key] ** 2)))[:_MAX_ROWS]
    conditions = sorted(largest)
    names = [
        f"{format_significant(1e3 * amplitude)} mm, {format_significant(frequency)} Hz, "
        f"{format_significant(drive)} {drive_unit}"
        for amplitude, frequency, drive in conditions
    ]
    return names, np.array([gaps[key] for key in conditions])

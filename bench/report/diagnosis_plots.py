"""The pictures of a diagnosis: how far the gap shrinks, which stage it comes from, where it shows."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bench.report.diagnosis import Diagnosis, Place, spelt, together
from bench.report.drawing import INK, bars, colour_bar, new_figure, style
from bench.report.values import significant

_GAP, _REST, _PALE = "#b5473c", "#3f7d58", "#c9ced4"
_CLEAR = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
"""Behind a figure that the line of the floor may cross."""
_PHASES = 8
"""Parts of a cycle that are told apart."""
_MOST_ROWS = 18
"""Conditions shown, those with the largest gap."""

Numbers = npt.NDArray[np.float64]


def shrinkage(found: Diagnosis) -> Figure:
    """Force error on strokes that no fit saw, before and after, beside the floor; the stages' probabilities."""
    figure = new_figure(9.0, 2.9)
    left, right = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
    _draw_errors(left, found)
    _draw_stages(right, found)
    return figure


def place(found: Diagnosis, drive_unit: str) -> Figure | None:
    """Where the gap shows: condition by phase of the stroke; none where there is no gap, or nothing repeats.

    Args:
        found: the diagnosis.
        drive_unit: V or A.
    """
    if found.verdict == "no_gap":
        return None
    rows, grid = _by_condition([one for one in found.where.map if one.frequency_hz > 0], drive_unit)
    if not rows:
        return None
    figure = new_figure(9.0, 1.3 + 0.24 * len(rows))
    axes = figure.subplots()
    drawn = axes.imshow(grid, aspect="auto", cmap="OrRd", vmin=0.0, interpolation="nearest")
    axes.set_yticks(range(len(rows)), rows)
    axes.set_xticks(np.arange(0, _PHASES + 1, 2) - 0.5, ["out, fastest", "end", "in, fastest", "end", "out"])
    style(axes, "phase of the stroke", "")
    axes.grid(visible=False)
    colour_bar(figure, [axes], drawn, "gap beyond the noise [N]")
    return figure


def _draw_errors(axes: Axes, found: Diagnosis) -> None:
    gap = found.gap
    errors = [("refitted law", gap.before_n, _REST if found.verdict == "no_gap" else _GAP)]
    if gap.nominal_n is not None:
        errors.insert(0, ("given simulation", gap.nominal_n, _GAP))
    if found.effects:
        named = together([one.name for one in found.effects]).replace(" and ", "\nand ")
        errors.append((f"with {named}", gap.after_n, _REST))
    bars(axes, errors, "force error on strokes never seen, RMSE [N]; dashed: noise floor")
    for at, (_, size, _) in enumerate(errors):
        axes.annotate(
            f"{significant(size)} N",
            (size, at),
            xytext=(6, 0),
            textcoords="offset points",
            va="center",
            fontsize=8.5,
            color=INK,
            bbox=_CLEAR,
        )
    axes.axvline(gap.noise_floor_n, color=INK, linewidth=1.2, linestyle=(0, (4, 3)))
    axes.set_ylim(max(len(errors), 2) - 0.5, -0.5)  # a bar alone is no broader than one of two
    axes.set_xlim(0, 1.25 * max(size for _, size, _ in errors))


def _draw_stages(axes: Axes, found: Diagnosis) -> None:
    chances = [
        (spelt(stage), chance, _GAP if chance > 0.5 else _PALE) for stage, chance in found.where.stages.items()
    ]
    bars(axes, chances, "probability that something is missing there")
    axes.set_xlim(0, 1)


def _by_condition(places: Sequence[Place], drive_unit: str) -> tuple[list[str], Numbers]:
    """Names of the conditions, those with the largest gap first, and (conditions, phases) gap [N]."""
    gaps: dict[tuple[float, float, float], Numbers] = {}
    for one in places:
        row = gaps.setdefault((one.amplitude_m, one.frequency_hz, one.drive), np.zeros(_PHASES))
        row[int(one.phase * _PHASES) % _PHASES] = one.gap_n
    largest = sorted(gaps, key=lambda key: -float(np.sum(gaps[key] ** 2)))[:_MOST_ROWS]
    shown = sorted(largest)
    names = [
        f"{significant(1e3 * amplitude)} mm, {significant(frequency)} Hz, {significant(drive)} {drive_unit}"
        for amplitude, frequency, drive in shown
    ]
    return names, np.array([gaps[key] for key in shown])

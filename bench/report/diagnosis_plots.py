"""The pictures of a diagnosis: how far the gap shrinks, which stage it comes from, where it shows."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bench.report.diagnosis import Diagnosis, Place, spelt, together
from bench.report.drawing import INK, new_figure, style
from bench.report.values import significant

_GAP, _REST, _PALE = "#b5473c", "#3f7d58", "#c9ced4"
_PHASES = 8
_MOST_ROWS = 18

Numbers = npt.NDArray[np.float64]


def shrinkage(found: Diagnosis) -> Figure:
    """Force error on strokes that no fit saw, before and after, beside the floor; the stages' probabilities."""
    figure = new_figure(9.0, 2.9)
    left, right = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
    _draw_errors(left, found)
    _draw_stages(right, found)
    return figure


def place(found: Diagnosis) -> Figure | None:
    """Where the gap shows: condition by phase of the stroke; none where there is no gap, or nothing repeats."""
    if found.verdict == "no_gap":
        return None
    rows, grid = _by_condition([one for one in found.where.map if one.frequency_hz > 0])
    if not rows:
        return None
    figure = new_figure(9.0, 1.3 + 0.24 * len(rows))
    axes = figure.subplots()
    drawn = axes.imshow(grid, aspect="auto", cmap="OrRd", vmin=0.0, interpolation="nearest")
    axes.set_yticks(range(len(rows)), rows)
    axes.set_xticks(np.arange(0, _PHASES + 1, 2) - 0.5, ["out, fastest", "end", "in, fastest", "end", "out"])
    style(axes, "phase of the stroke", "")
    axes.grid(visible=False)
    bar = figure.colorbar(drawn, ax=axes, fraction=0.03, pad=0.01)
    bar.set_label("gap beyond the noise [N]", color=INK, fontsize=9)
    bar.ax.tick_params(colors=INK, labelsize=8, length=2)
    bar.outline.set_visible(False)
    return figure


def _draw_errors(axes: Axes, found: Diagnosis) -> None:
    gap = found.gap
    bars = [("refitted law", gap.before_n, _GAP)]
    if gap.nominal_n is not None:
        bars.insert(0, ("given simulation", gap.nominal_n, _GAP))
    if found.effects:
        bars.append((f"with {together([one.name for one in found.effects])}", gap.after_n, _REST))
    places = np.arange(len(bars))
    axes.barh(places, [size for _, size, _ in bars], height=0.55, color=[colour for _, _, colour in bars])
    for at, (_, size, _) in zip(places, bars, strict=True):
        axes.annotate(f" {significant(size)} N", (size, at), va="center", fontsize=8.5, color=INK)
    axes.axvline(gap.noise_floor_n, color=INK, linewidth=1.2, linestyle=(0, (4, 3)))
    axes.set_yticks(places, [name.replace(" and ", "\nand ") for name, _, _ in bars])
    axes.invert_yaxis()
    axes.set_xlim(0, 1.25 * max(size for _, size, _ in bars))
    style(axes, "force error on strokes never seen, RMSE [N]; dashed: noise floor", "")
    axes.grid(visible=False, axis="y")


def _draw_stages(axes: Axes, found: Diagnosis) -> None:
    names = list(found.where.stages)
    places = np.arange(len(names))
    chances = [found.where.stages[name] for name in names]
    axes.barh(places, chances, height=0.55, color=[_GAP if chance > 0.5 else _PALE for chance in chances])
    axes.set_yticks(places, [spelt(name) for name in names])
    axes.invert_yaxis()
    axes.set_xlim(0, 1)
    style(axes, "probability that something is missing there", "")
    axes.grid(visible=False, axis="y")


def _by_condition(places: Sequence[Place]) -> tuple[list[str], Numbers]:
    """Names of the conditions, those with the largest gap first, and (conditions, phases) gap [N]."""
    sums: dict[tuple[float, float, float], Numbers] = {}
    for one in places:
        row = sums.setdefault((one.amplitude_m, one.frequency_hz, one.drive), np.zeros(_PHASES))
        row[int(one.phase * _PHASES) % _PHASES] = one.gap_n
    largest = sorted(sums, key=lambda key: -float(np.sum(sums[key] ** 2)))[:_MOST_ROWS]
    shown = sorted(largest)
    names = [
        f"{significant(1e3 * amplitude)} mm, {significant(frequency)} Hz, drive {significant(drive)}"
        for amplitude, frequency, drive in shown
    ]
    return names, np.array([sums[key] for key in shown])

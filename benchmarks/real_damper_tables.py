"""Tables of the real dampers: where the held-out error sits."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from benchmarks.desk import Desk, Found
from benchmarks.laid_over import Cycles, cycles_of
from benchmarks.prediction_series import Series
from identification.assemble import HoldOut, assemble
from identification.prediction import normalised
from identification.recordings import load
from identification.results import read_fit
from identification.simulate import Setting

TEST = ("5mm_4Hz", "25mm_0.5Hz")
FAST = ("5mm_4Hz", "5mm_3Hz", "10mm_2Hz")
"""Strokes recorded at 1 kHz."""
SLOW = ("2mm_5Hz", "25mm_0.5Hz", "25mm_0.25Hz")
"""Strokes recorded at 200 Hz."""
STROKES = (*FAST, *SLOW)
CURRENTS = ("0", "0.25", "0.5", "0.75", "1")
BARS = {"utfsm": 0.099, "nees": 0.181}
"""[1] held-out NRMSE that a quick least-squares fit of the same law reached."""
QUICK_BY_CURRENT = dict(zip(CURRENTS, (0.253, 0.159, 0.093, 0.080, 0.097), strict=True))
"""[1] the same by current."""


def names_of(strokes: Sequence[str], currents: Sequence[str]) -> list[str]:
    """Stretches of these strokes at these currents."""
    return [f"{stroke}_{current}A" for stroke in strokes for current in currents]


def error_of(series: Series, names: Sequence[str]) -> tuple[float, float]:
    """RMSE [N] and NRMSE [1] over several stretches."""
    return series.error(np.any([series.rows(name) for name in names], axis=0))


def summary(log: str, label: str, found: Found) -> dict[str, Any]:
    """One row of the table of results."""
    d = found.document
    held, bar = d["nrmse"]["held_out"], BARS[log]
    return {
        "log": log,
        "label": label,
        "train": d["nrmse"]["train"],
        "held": held,
        "held_n": d["rmse_n"]["held_out"],
        "bar": bar,
        "below": 100 * (1 - held / bar),
        "floors": d["rmse_n"]["held_out"] / d["noise_floor_n"],
        "seconds": d["stages"][-1]["seconds"],
        "result": d["result"],
    }


def witness(row: dict[str, Any], found: Found) -> dict[str, Any]:
    """What the network says of a recording, beside the refinement's row in the table of results."""
    network, refined = found.document["stages"]
    assert (network["name"], refined["name"]) == ("pinn", "refine")
    names = ("D_y", "rho", "n", "F_a", "c0_a", "c1_a", "k0", "k1")
    own, fitted = network["coordinates"], found.document["coordinates"]
    return row | {
        "network": network,
        "network_held": network["simulated_n"]["held_out"],
        "ratio": network["simulated_n"]["held_out"] / row["held_n"],
        "agreement": found.document["agreement"],
        "coordinates": {name: (own[name]["value"], fitted[name]["value"], own[name]["unit"]) for name in names},
    }


def by_current(fits: dict[str, Found], alone: dict[str, Found]) -> list[dict[str, Any]]:
    """Errors of the common fits and of a fit of each current alone, on the strokes held out."""
    rows = []
    for current in CURRENTS:
        held, rest = names_of(TEST, [current]), names_of([s for s in STROKES if s not in TEST], [current])
        fitted = fits[""].series
        cycles = [cycles_of(fitted, name) for name in names_of(STROKES, [current])]
        rows.append(
            {
                "current": current,
                "held": error_of(fitted, held),
                "as_recorded": error_of(fits["-as-recorded"].series, held)[1],
                "quick": QUICK_BY_CURRENT[current],
                "train": error_of(fitted, rest)[1],
                "alone": error_of(alone[current].series, held)[1],
                "alone_fit": alone[current].document["coordinates"],
                "alone_delay": alone[current].delay,
                "plateau": float(np.mean([c.on_the_plateau for c in cycles])),
                **shared_parts(cycles),
            }
        )
    return rows


def together(alone: dict[str, Found]) -> float:
    """[1] held-out NRMSE where every current has a law of its own."""
    pairs = []
    for current, found in alone.items():
        rows = np.any([found.series.rows(name) for name in names_of(TEST, [current])], axis=0)
        pairs.append((found.series.residual[rows], found.series.force[rows]))
    residuals, forces = zip(*pairs, strict=True)
    return normalised(np.concatenate(residuals), np.concatenate(forces))


def shared_parts(cycles: Sequence[Cycles]) -> dict[str, float]:
    """What the residual of some files holds in common over their cycles, and where."""
    squares = np.array([c.repeating**2 for c in cycles])
    return {
        "repeating": float(np.sqrt(squares.mean())),
        "scatter": float(np.sqrt(np.mean([c.scatter**2 for c in cycles]))),
        "reversals": float(np.sum([c.at_reversals for c in cycles] * squares) / squares.sum()),
    }


def by_file(found: Found) -> list[dict[str, Any]]:
    """Errors and residual of every file held out."""
    rows = []
    for name in names_of(TEST, CURRENTS):
        inside = found.series.rows(name)
        bias = float(found.series.residual[inside].mean())
        rows.append(
            {"name": name, "error": found.series.error(inside), "bias": bias}
            | shared_parts([cycles_of(found.series, name)])
        )
    return rows


def at_rest(desk: Desk, log: str, hold_out: Sequence[str]) -> float:
    """[1] held-out NRMSE where y(0) of the held-out files is not fitted to them but taken as 0."""
    fit = read_fit(desk.folder / f"{log}.json")
    assembled = assemble([load(desk.folder / f"{log}.mcap")], HoldOut(tuple(f"{s}*" for s in hold_out)))
    delay = fit.nuisances.force_delay.value
    held = [p for p, out in zip(assembled.pieces, assembled.held_out, strict=True) if out.any()]
    errors = [p.recorded(Setting(fit.point(), force_delay=p.force_delay + delay))[0] - p.force for p in held]
    return normalised(np.concatenate(errors), np.concatenate([p.force for p in held]))


def by_voltage(fits: dict[str, Found]) -> list[dict[str, Any]]:
    """Errors at the two voltages between which the drive switches."""
    levels = [row["drive"] for row in fits[""].document["per_drive"]]
    held = fits[""].series.held_out
    rows = []
    for level in levels:
        near = np.abs(fits[""].series.drive - level) < 0.5 * np.ptp(levels)
        row = {"level": level, "samples": int(np.sum(near & held)), "train": fits[""].series.error(near & ~held)}
        row |= {f"held{key}": found.series.error(near & held) for key, found in fits.items()}
        rows.append(row)
    return rows


def by_speed(series: Series, driven: np.ndarray) -> list[dict[str, Any]]:
    """Where the residual of the held-out part sits, by speed of the stroke."""
    speed, rows = np.abs(series.velocity), []
    edges = (0.0, 0.03, 0.06, 0.1, 0.2, np.inf)
    for low, high in pairwise(edges):
        inside = driven & (speed >= low) & (speed < high)
        squares = float(np.sum(series.residual[inside] ** 2) / np.sum(series.residual[driven] ** 2))
        row = {"low": low, "high": high, "time": inside.sum() / driven.sum(), "squares": squares}
        rows.append(row | {"rmse": series.error(inside)[0]})
    return rows


def swift(series: Series, rows: np.ndarray, above: float = 40.0) -> float:
    """[1] part of the squared residual of consecutive samples above a frequency [Hz]."""
    residual = series.residual[rows]
    power = np.abs(np.fft.rfft(residual * np.hanning(len(residual)))) ** 2
    frequency = np.fft.rfftfreq(len(residual), float(np.median(np.diff(series.time[rows]))))
    return float(power[frequency > above].sum() / power.sum())


def inertia(series: Series, rows: np.ndarray) -> tuple[float, float]:
    """Mass [kg] that would best repeat the residual, and the NRMSE [1] it would leave."""
    acceleration = np.gradient(series.velocity, series.time)[rows]
    residual = series.residual[rows]
    mass = float(acceleration @ residual / (acceleration @ acceleration))
    return mass, normalised(residual - mass * acceleration, series.force[rows])

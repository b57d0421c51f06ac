"""Tables of the held-out errors of the real dampers, by conditions."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from benchmarks.common import Cycles, PredictionSeries, SimulatedFit, Workspace, find_cycles
from identification.documents import read_fit
from identification.fitting import HoldOut, assemble, compute_nrmse
from identification.logs import load
from identification.simulate import SimulationModel

TEST_STROKES = ("5mm_4Hz", "25mm_0.5Hz")
FAST_STROKES = ("5mm_4Hz", "5mm_3Hz", "10mm_2Hz")
"""Strokes recorded at 1 kHz."""
SLOW_STROKES = ("2mm_5Hz", "25mm_0.5Hz", "25mm_0.25Hz")
"""Strokes recorded at 200 Hz."""
STROKES = (*FAST_STROKES, *SLOW_STROKES)
CURRENTS = ("0", "0.25", "0.5", "0.75", "1")
REFERENCE_NRMSE = {"utfsm": 0.099, "nees": 0.181}
"""Held-out NRMSE of a quick least-squares fit of the same law [1]."""
REFERENCE_BY_CURRENT = dict(zip(CURRENTS, (0.253, 0.159, 0.093, 0.080, 0.097), strict=True))
"""Held-out NRMSE of that fit by current, utfsm [1]."""


def make_stretch_names(strokes: Sequence[str], currents: Sequence[str]) -> list[str]:
    """Return the names of the stretches of these strokes at these currents."""
    return [f"{stroke}_{current}A" for stroke in strokes for current in currents]


def compute_stretch_error(series: PredictionSeries, names: Sequence[str]) -> tuple[float, float]:
    """Compute RMSE [N] and NRMSE [1] over several stretches."""
    return series.compute_error(np.any([series.select_rows(name) for name in names], axis=0))


def summarise_fit(log: str, label: str, found: SimulatedFit) -> dict[str, Any]:
    """Return one row of the table of results."""
    d = found.document
    held, reference = d["nrmse"]["held_out"], REFERENCE_NRMSE[log]
    return {
        "log": log,
        "label": label,
        "train": d["nrmse"]["train"],
        "held": held,
        "held_n": d["rmse_n"]["held_out"],
        "reference": reference,
        "below": 100 * (1 - held / reference),
        "floors": d["rmse_n"]["held_out"] / d["noise_floor_n"],
        "seconds": d["stages"][-1]["seconds"],
        "result": d["result"],
    }


def compare_network(row: dict[str, Any], found: SimulatedFit) -> dict[str, Any]:
    """Return a row of the table of results, with the result of the network for comparison."""
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


def tabulate_by_current(fits: dict[str, SimulatedFit], alone: dict[str, SimulatedFit]) -> list[dict[str, Any]]:
    """Return held-out errors of the common fits and of a separate fit of each current, by current."""
    rows = []
    for current in CURRENTS:
        held, rest = (
            make_stretch_names(TEST_STROKES, [current]),
            make_stretch_names([s for s in STROKES if s not in TEST_STROKES], [current]),
        )
        fitted = fits[""].series
        cycles = [find_cycles(fitted, name) for name in make_stretch_names(STROKES, [current])]
        rows.append(
            {
                "current": current,
                "held": compute_stretch_error(fitted, held),
                "as_recorded": compute_stretch_error(fits["-as-recorded"].series, held)[1],
                "quick": REFERENCE_BY_CURRENT[current],
                "train": compute_stretch_error(fitted, rest)[1],
                "alone": compute_stretch_error(alone[current].series, held)[1],
                "alone_fit": alone[current].document["coordinates"],
                "alone_delay": alone[current].delay,
                "plateau": float(np.mean([c.plateau_excess for c in cycles])),
                **decompose_residual(cycles),
            }
        )
    return rows


def compute_pooled_nrmse(alone: dict[str, SimulatedFit]) -> float:
    """Compute the held-out NRMSE [1] of separate fits for all currents."""
    pairs = []
    for current, found in alone.items():
        rows = np.any(
            [found.series.select_rows(name) for name in make_stretch_names(TEST_STROKES, [current])], axis=0
        )
        pairs.append((found.series.residual[rows], found.series.force[rows]))
    residuals, forces = zip(*pairs, strict=True)
    return compute_nrmse(np.concatenate(residuals), np.concatenate(forces))


def decompose_residual(cycles: Sequence[Cycles]) -> dict[str, float]:
    """Divide the residual of some files into repeating part [N], scatter [N] and fraction at reversals [1]."""
    squares = np.array([c.repeating_rms**2 for c in cycles])
    return {
        "repeating": float(np.sqrt(squares.mean())),
        "scatter": float(np.sqrt(np.mean([c.scatter**2 for c in cycles]))),
        "reversals": float(np.sum([c.reversal_share for c in cycles] * squares) / squares.sum()),
    }


def tabulate_by_file(found: SimulatedFit) -> list[dict[str, Any]]:
    """Return errors and parts of the residual of all held-out files."""
    rows = []
    for name in make_stretch_names(TEST_STROKES, CURRENTS):
        inside = found.series.select_rows(name)
        bias = float(found.series.residual[inside].mean())
        rows.append(
            {"name": name, "error": found.series.compute_error(inside), "bias": bias}
            | decompose_residual([find_cycles(found.series, name)])
        )
    return rows


def compute_rest_start_nrmse(workspace: Workspace, log: str, hold_out: Sequence[str]) -> float:
    """Compute the held-out NRMSE [1] with y(0) = 0 instead of its estimate in the held-out files."""
    fit = read_fit(workspace.folder / f"{log}.json")
    assembled = assemble([load(workspace.folder / f"{log}.mcap")], HoldOut(tuple(f"{s}*" for s in hold_out)))
    delay = fit.nuisances.force_delay.value
    held = [p for p, out in zip(assembled.pieces, assembled.held_out, strict=True) if out.any()]
    errors = [
        p.simulate(SimulationModel(fit.to_coordinates(), force_delay=p.force_delay + delay))[0] - p.force
        for p in held
    ]
    return compute_nrmse(np.concatenate(errors), np.concatenate([p.force for p in held]))


def tabulate_by_voltage(fits: dict[str, SimulatedFit]) -> list[dict[str, Any]]:
    """Return the errors at the two voltages between which the drive switches."""
    levels = [row["drive"] for row in fits[""].document["per_drive"]]
    held = fits[""].series.held_out
    rows = []
    for level in levels:
        near = np.abs(fits[""].series.drive - level) < 0.5 * np.ptp(levels)
        row = {
            "level": level,
            "samples": int(np.sum(near & held)),
            "train": fits[""].series.compute_error(near & ~held),
        }
        row |= {f"held{key}": found.series.compute_error(near & held) for key, found in fits.items()}
        rows.append(row)
    return rows


def tabulate_by_speed(series: PredictionSeries, driven: np.ndarray) -> list[dict[str, Any]]:
    """Return the residual of the held-out part by speed of the stroke."""
    speed, rows = np.abs(series.velocity), []
    edges = (0.0, 0.03, 0.06, 0.1, 0.2, np.inf)
    for low, high in pairwise(edges):
        inside = driven & (speed >= low) & (speed < high)
        squares = float(np.sum(series.residual[inside] ** 2) / np.sum(series.residual[driven] ** 2))
        row = {"low": low, "high": high, "time": inside.sum() / driven.sum(), "squares": squares}
        rows.append(row | {"rmse": series.compute_error(inside)[0]})
    return rows


def compute_high_frequency_share(series: PredictionSeries, rows: np.ndarray, above: float = 40.0) -> float:
    """Compute the fraction [1] of the squared residual of consecutive samples above a frequency [Hz]."""
    residual = series.residual[rows]
    power = np.abs(np.fft.rfft(residual * np.hanning(len(residual)))) ** 2
    frequency = np.fft.rfftfreq(len(residual), float(np.median(np.diff(series.time[rows]))))
    return float(power[frequency > above].sum() / power.sum())


def estimate_inertia(series: PredictionSeries, rows: np.ndarray) -> tuple[float, float]:
    """Estimate the mass [kg] whose inertia best fits the residual, and the NRMSE [1] that remains."""
    acceleration = np.gradient(series.velocity, series.time)[rows]
    residual = series.residual[rows]
    mass = float(acceleration @ residual / (acceleration @ acceleration))
    return mass, compute_nrmse(residual - mass * acceleration, series.force[rows])

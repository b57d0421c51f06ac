"""Comparisons of the fake service: three recorded runs of one damper, compared by the code of the product."""

from datetime import UTC, datetime
from functools import lru_cache
from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Query
from fastapi.responses import JSONResponse

from bench.comparison import ComparedRun, ComparisonRequest, ForceSeries, RecordedRun, compare_runs
from bench.samples import SampleTable, SegmentRange

RATE, CYCLES = 500.0, 4
STROKES = ((0.005, 2.5), (0.010, 1.0), (0.012, 1.25))
"""Amplitude [m] and frequency [Hz]."""
DRIVES = (0.0, 0.2, 0.4)
RUNS = {
    "run-1": {"gain": 1.0, "temperature": 22.0},
    "run-2": {"gain": 1.05, "temperature": 26.5},
    "run-3": {"gain": 1.3, "temperature": 22.5, "stretch": 1.1, "preload": 25.0},
}
TRUNCATED = (
    "run run-0: run-0.mcap: the log is truncated, its recorder was killed; run `mrbench salvage run-0.mcap`"
)


def comparison_routes() -> APIRouter:
    """Create the route of comparisons: run-0 is truncated, and a run of any other name does not exist."""
    router = APIRouter()

    @router.get("/comparisons")
    def compare(
        run: Annotated[list[str], Query()], reference: str | None = None, tolerance_percent: float = 10.0
    ) -> Any:
        unknown = next((one for one in run if one not in RUNS), None)
        if unknown is not None:
            return refuse(unknown)
        request = ComparisonRequest(runs=tuple(run), reference=reference, tolerance_percent=tolerance_percent)
        return compare_runs([record(one) for one in run], request)

    return router


def refuse(run: str) -> JSONResponse:
    """Return the problem of a run that cannot be compared."""
    status, detail = (409, TRUNCATED) if run == "run-0" else (404, f"there is no run {run}")
    content = {"type": "about:blank", "title": "Not possible", "status": status, "detail": detail}
    return JSONResponse(content, status_code=status, media_type="application/problem+json")


@lru_cache
def record(run: str) -> RecordedRun:
    """Return a run; the first two have a fit."""
    number, made = int(run[-1]), RUNS[run]
    started = datetime(2025, 3, 4, 9, 10 + number, 30, tzinfo=UTC)
    fitted = number < 3
    facts = ComparedRun(
        run=run, specimen="MR-0042", method="quick", started=started, fit=f"job-{run}" if fitted else None
    )
    table = make_table(number, **made)
    return RecordedRun(
        facts, table, make_fit(made["gain"]) if fitted else None, make_series(table) if fitted else None
    )


def make_table(
    seed: int, gain: float, temperature: float, stretch: float = 1.0, preload: float = 0.0
) -> SampleTable:
    """Return all strokes at all drives, one after the other; ``stretch`` is a factor on their amplitudes."""
    parts: list[dict[str, Any]] = []
    segments: list[SegmentRange] = []
    first = 0
    for index, ((amplitude, frequency), drive) in enumerate((s, d) for s in STROKES for d in DRIVES):
        count = round(CYCLES * RATE / frequency)
        parts.append(make_columns(count, stretch * amplitude, frequency, drive))
        name = f"{1e3 * amplitude:g}mm_{frequency:g}Hz_{drive:g}V"
        segments.append(
            SegmentRange(
                index=index, name=name, stretch="quick", motion="sine", drive="constant", amplitude_m=amplitude,
                frequency_hz=frequency, drive_value=drive, start_s=first / RATE,
                stop_s=(first + count - 1) / RATE, first=first, samples=count,
            )
        )  # fmt: skip
        first += count
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    noise = np.random.default_rng(seed).normal(0.0, 2.0, first)
    columns["force"] = gain * columns["force"] + preload + noise
    columns["temperature"] = np.full(first, temperature)
    made = {name: values.astype(np.float32) for name, values in columns.items()}
    return SampleTable(np.arange(first) / RATE, made, dict.fromkeys(made, "1"), tuple(segments), "V", None)


def make_columns(count: int, amplitude: float, frequency: float, drive: float) -> dict[str, Any]:
    """Return a sine with a hysteresis loop."""
    angle = 2 * np.pi * frequency * np.arange(count) / RATE
    displacement, speed = amplitude * np.sin(angle), amplitude * 2 * np.pi * frequency * np.cos(angle)
    force = (60 + 900 * drive) * np.tanh((speed + 8 * displacement) / 0.02) + (700 + 2200 * drive) * speed
    return {
        "displacement": displacement, "velocity": speed, "force": force, "coil_drive": np.full(count, drive),
    }  # fmt: skip


def make_fit(gain: float) -> dict[str, Any]:
    """Return the parameters of a fit; the damping follows the gain, the stiffness does not."""
    entry = {"identifiable": True}
    damping, stiffness = 700 * gain, 2200.0 + gain
    return {
        "parameters": {
            "c0_a": entry | {"value": damping, "unit": "N s/m", "ci95": [damping - 5, damping + 5]},
            "k0": entry | {"value": stiffness, "unit": "N/m", "ci95": [stiffness - 40, stiffness + 40]},
        }
    }


def make_series(table: SampleTable) -> ForceSeries:
    """Return a simulation with a 95 % band of 6 N on both sides."""
    force = table.columns["force"].astype(np.float64)
    names = ("displacement", "velocity", "drive", "force", "simulated")
    held_out = np.zeros(len(force), bool)
    return ForceSeries(table.time, dict.fromkeys(names, force), held_out, np.full(len(force), 6.0), "V")

"""Zero and shunt checks for tests: logs as a bench records them, records and series of them."""

import json
from datetime import UTC, datetime, timedelta

import numpy as np

from bench.catalogue import RunRow
from bench.checks import BASELINE_POINTS, CheckRecord
from bench.log.header import RunHeader
from bench.log.writer import LogWriter

START = datetime(2026, 1, 5, 8, 0, tzinfo=UTC)
RATE = 200
"""[Hz]"""
SETTLE, REST = 1, 4
"""[s] Duration of both segments."""
IN_CONTROL = [1.0, -1.0] * (BASELINE_POINTS // 2)
"""[N] Baseline with centre 0 and moving range 2."""
MOUNTED = "S-1"


def make_records(values, uncertainty=0.1, channel="force", unit="N", start=START, **changes):
    """Return one record per day with the given values."""
    return [
        CheckRecord(
            **{
                "run": f"run-{index}",
                "check": "zero",
                "channel": channel,
                "unit": unit,
                "value": value,
                "standard_deviation": 2.5,
                "standard_uncertainty": uncertainty,
                "samples": 20_000,
                "independent_samples": 625,
                "duration_s": 20.0,
                "measured": start + timedelta(days=index),
                "specimen": MOUNTED,
                "bench": "bench",
                "instrument": "load_cell",
                "serial": "1",
                "temperature_c": 22.0,
            }
            | changes
        )
        for index, value in enumerate(values)
    ]


def store_checks(catalogue, values):
    """Store one check of the force per day with the given values [N], and of the displacement at rest."""
    noise = np.random.default_rng(3).normal(2e-5, 2e-6, len(values)).tolist()
    for record, other in zip(make_records(values), make_records(noise, 1e-7, "displacement", "m"), strict=True):
        name = record.run
        catalogue.add(
            RunRow(id=name, method="zero_check", started=record.measured, state="ended", log=f"{name}.mcap")
        )
        catalogue.checks.replace(name, [record, other])


def write_check_log(path, run="check-1", zero_n=0.0, day=0, seed=1, **changes):
    """Write the log of a zero check.

    Args:
        path: file of the log.
        run: id of the run.
        zero_n: [N] force at rest, before the tare.
        day: days from `START` to the check.
        seed: seed of the noise of 2.5 N.
        changes: `method`, `motion`, `outcome`, `tare_n` in place of those of a zero check.
    """
    given = {"method": "zero_check", "motion": "hold", "outcome": "clean", "tare_n": 50.0} | changes
    columns = _make_columns((SETTLE + REST) * RATE, zero_n, given["tare_n"], seed)
    return _write_log(path, run, day, given, columns, [("settle", SETTLE), ("rest", REST)])


def write_shunt_log(path, run="shunt-1", shunt_n=1000.0, day=0, seed=1, **changes):
    """Write the log of a shunt check.

    Args:
        path: file of the log.
        run: id of the run.
        shunt_n: [N] change of the force by the shunt.
        day: days from `START` to the check.
        seed: seed of the noise.
        changes: `method`, `motion`, `outcome`, `tare_n` in place of those of a shunt check; `drift` [N/s] of the
            force; `noise_n`; `late_s`: time by which the force follows the shunt too late [s]; `rests`: seconds
            before and after; `marked`: segments that are marked as those with the shunt; `names` of the segments.
    """
    given = {
        "method": "shunt_check", "motion": "hold", "outcome": "clean", "tare_n": 50.0, "drift": 0.0,
        "noise_n": 2.5, "late_s": 0.0, "rests": (REST, REST), "marked": ("shunt",),
        "names": ("rest", "shunt", "rest_after"),
    } | changes  # fmt: skip
    before, after = given["rests"]
    durations = [SETTLE, before, REST, after]
    samples = sum(durations) * RATE
    columns = _make_columns(samples, 0.0, given["tare_n"], seed, given["noise_n"])
    time = np.arange(samples) / RATE
    begin = SETTLE + before + given["late_s"]
    change = np.where((time >= begin) & (time < begin + REST), shunt_n, 0.0) + given["drift"] * time
    for field in ("force", "force_raw"):
        columns[field] += change
    return _write_log(
        path, run, day, given, columns, list(zip(("settle", *given["names"]), durations, strict=True))
    )


def _write_log(path, run, day, given, columns, segments):
    """Write a log of segments, given by name and duration [s]."""
    header = RunHeader(
        id=run,
        specimen=MOUNTED,
        method=given["method"],
        drive_kind="coil_v",
        drive_unit="V",
        source="run",
        utc_offset=(START + timedelta(days=day)).isoformat(),
    )
    edges = np.cumsum([0, *(duration * RATE for _, duration in segments)])
    time_ns = np.arange(edges[-1], dtype=np.int64) * (1_000_000_000 // RATE)
    with LogWriter(path, header) as log:
        log.attach("bench.toml", "application/toml", b'[rig]\nname = "bench 3"\n')
        cell = {"driver": "load_cell", "serial": "4242", "channels": [{"name": "force"}, {"name": "force_raw"}]}
        log.attach("instruments.json", "application/json", json.dumps({"cell": cell}).encode())
        for index, (name, _) in enumerate(segments):
            part = slice(edges[index], edges[index + 1])
            mark = {
                "index": index,
                "name": name,
                "stretch": given["method"],
                "motion": given["motion"],
                "drive": "constant",
                "amplitude": None,
                "frequency": None,
                "drive_value": 0.0,
                "shunt": name in given.get("marked", ()),
            }
            log.write_segment(int(time_ns[part][0]), phase="start", **mark)
            log.write_samples(time_ns[part], {field: column[part] for field, column in columns.items()})
            log.write_segment(int(time_ns[part][-1]), phase="end", **mark)
        log.close(given["outcome"], "" if given["outcome"] == "clean" else "stopped by the test")
    return path


def _make_columns(samples, zero_n, tare_n, seed, noise_n=2.5):
    generator = np.random.default_rng(seed)
    force = zero_n + noise_n * generator.normal(0, 1, samples)
    # Before the rest, the rod still moves.
    force[: SETTLE * RATE] += 500
    return {
        "displacement": 2e-5 + generator.normal(0, 2e-6, samples),
        "velocity": np.zeros(samples),
        "force": force - tare_n,
        "force_raw": force,
        "coil_drive": np.zeros(samples),
        "coil_voltage": generator.normal(0, 1e-3, samples),
        "temperature": np.full(samples, 21.5),
    }

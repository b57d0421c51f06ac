"""Zero checks for tests: logs as a bench records them, records and series of them."""

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
    header = RunHeader(
        id=run,
        specimen=MOUNTED,
        method=given["method"],
        drive_kind="coil_v",
        drive_unit="V",
        source="run",
        utc_offset=(START + timedelta(days=day)).isoformat(),
    )
    samples = (SETTLE + REST) * RATE
    time_ns = np.arange(samples, dtype=np.int64) * (1_000_000_000 // RATE)
    columns = _make_columns(samples, zero_n, given["tare_n"], seed)
    edges = (0, SETTLE * RATE, samples)
    with LogWriter(path, header) as log:
        log.attach("bench.toml", "application/toml", b'[rig]\nname = "bench 3"\n')
        cell = {"driver": "load_cell", "serial": "4242", "channels": [{"name": "force"}, {"name": "force_raw"}]}
        log.attach("instruments.json", "application/json", json.dumps({"cell": cell}).encode())
        for index, name in enumerate(("settle", "rest")):
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
            }
            log.write_segment(int(time_ns[part][0]), phase="start", **mark)
            log.write_samples(time_ns[part], {field: column[part] for field, column in columns.items()})
            log.write_segment(int(time_ns[part][-1]), phase="end", **mark)
        log.close(given["outcome"], "" if given["outcome"] == "clean" else "stopped by the test")
    return path


def _make_columns(samples, zero_n, tare_n, seed):
    generator = np.random.default_rng(seed)
    force = zero_n + generator.normal(0, 2.5, samples)
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

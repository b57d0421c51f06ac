"""Coverage of the intervals over many replicas of one damper and one method, each with fresh sensor noise.

The simulated rig records the method a few times without noise, each time with new clock errors and zero shifts, by
its own integrator, filters and delays. Each replica adds fresh noise and the resolution of the converters to
displacement, force and drive, and is fitted without an initial guess. The results file has one line for each
replica, so that an interrupted run can be continued:

    python -m benchmarks.accuracy.monte_carlo run METHOD FIRST LAST FILE
    python -m benchmarks.accuracy.monte_carlo random FIRST LAST FILE
    python -m benchmarks.accuracy.monte_carlo table FILE

`random` uses thirty seconds of random displacement with 5 µm of noise and a resolution of 3 µm. It also compares
the fit with the true damper on twenty seconds that the fit has not read.
"""

import json
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from benchmarks.accuracy.interval_coverage import record_run
from benchmarks.common import cache
from benchmarks.pinn import LABORATORY, make_random_recording
from identification.damper import Coordinates
from identification.fitting import assemble, compute_rmse, predict_piece
from identification.logs import Recording, Stretch
from identification.pipeline import identify
from sim_rig.scenario import Sensors

REPLICAS_PER_RECORDING = 20
"""Replicas that share one noise-free recording."""
QUANTILES = {95: 1.959964, 99: 2.575829}
NOISY_CHANNELS = ("displacement", "force", "coil_drive")
COARSE_RESOLUTION = 3e-6
"""Resolution of the displacement of a random stroke [m]."""


def write_noiseless_scenario(folder: Path) -> Path:
    """Write the default scenario without noise and resolution of the sensors; filters and delays are kept."""
    sensors = {
        name: sensor.model_copy(update={"noise": 0.0, "resolution": 0.0, "jitter": 0.0}).model_dump()
        for name, sensor in Sensors()
        if name in NOISY_CHANNELS
    }
    path = folder / "without_noise.json"
    content = {
        "schema": "mrbench.scenario/1",
        "description": "no noise",
        "damper": "laboratory",
        "sensors": sensors,
    }
    path.write_text(json.dumps(content))
    return path


def add_noise(recording: Recording, seed: int) -> Recording:
    """Return the recording with fresh noise and resolution as in the default scenario."""
    random = np.random.default_rng([7, seed])
    return replace(
        recording,
        stretches=tuple(_add_stretch_noise(s, random) for s in recording.stretches),
        sha256=f"{seed:064d}",
    )


def _add_stretch_noise(stretch: Stretch, random: np.random.Generator) -> Stretch:
    sensors = Sensors()

    def channel(name: str, values: np.ndarray) -> np.ndarray:
        sensor = getattr(sensors, name)
        step = sensor.resolution or 1.0
        noisy = values + sensor.noise * random.standard_normal(len(values))
        return np.asarray(np.round(noisy / step) * step)

    return replace(
        stretch,
        displacement=channel("displacement", stretch.displacement),
        force=channel("force", stretch.force),
        drive=channel("coil_drive", stretch.drive),
    )


def run(method: str, first: int, last: int, results: Path) -> None:
    """Fit the replicas from ``first`` up to, not including, ``last`` that are not in the file yet."""
    known = {row["seed"] for row in cache.read_rows(results)}
    # Replicas of one recording share its clock errors and zero shifts.
    for base in sorted({seed // REPLICAS_PER_RECORDING for seed in range(first, last) if seed not in known}):
        with TemporaryDirectory() as folder:
            recording, true, _ = record_run(
                method, base, Path(folder), str(write_noiseless_scenario(Path(folder)))
            )
        for seed in range(
            max(first, base * REPLICAS_PER_RECORDING), min(last, (base + 1) * REPLICAS_PER_RECORDING)
        ):
            if seed not in known:
                cache.append_row(results, _fit_replica(add_noise(recording, seed), seed, true))


def _fit_replica(recording: Recording, seed: int, true: Coordinates) -> dict[str, Any]:
    began = time.process_time()
    fit = identify([recording])
    return {
        "seed": seed,
        "seconds": time.process_time() - began,
        "result": fit.result,
        "ratio": fit.rmse_n.train / fit.noise_floor_n,
        "coordinates": {
            name: {
                "true": getattr(true, name),
                "value": e.value,
                "ci95": e.ci95,
                "ci99": e.ci99,
                "identifiable": e.identifiable,
            }
            for name, e in fit.coordinates.items()
        },
    }


def run_random(first: int, last: int, results: Path) -> None:
    """Fit random strokes with a noisy displacement of coarse resolution."""
    for seed in range(first, last):
        row = _fit_replica(_quantise(make_random_recording(seed, 30.0)), seed, LABORATORY)
        point = Coordinates(**{name: c["value"] for name, c in row["coordinates"].items()})
        pieces = assemble([_quantise(make_random_recording(1000 + seed))]).pieces
        errors = [
            np.concatenate([predict_piece(p, c).force - p.force for p in pieces]) for c in (point, LABORATORY)
        ]
        row["unseen"] = compute_rmse(errors[0]) / compute_rmse(errors[1])
        cache.append_row(results, row)


def _quantise(recording: Recording) -> Recording:
    return replace(
        recording,
        stretches=tuple(
            replace(s, displacement=np.round(s.displacement / COARSE_RESOLUTION) * COARSE_RESOLUTION)
            for s in recording.stretches
        ),
    )


def print_table(results: Path) -> None:
    """Print the coverage, pooled and by coordinate, and mean and deviation of the errors in fit deviations."""
    found = cache.read_rows(results)
    names = list(found[0]["coordinates"])
    inside = {level: [_find_covered(found, name, f"ci{level}") for name in names] for level in QUANTILES}
    print(f"{len(found)} replicas, {sum(r['result'] == 'converged' for r in found)} with the result `converged`")
    print(f"processor time of a fit, median {np.median([r['seconds'] for r in found]):.1f} s")
    if validation := [r["unseen"] for r in found if "unseen" in r]:
        print(
            f"validation force error over the true damper's: largest {max(validation):.4f}, "
            f"median {np.median(validation):.4f}"
        )
    for level, hits in inside.items():
        every = np.concatenate(hits)
        # Errors of the coordinates of one fit are correlated; the shares of different replicas are independent.
        error = 100 * np.std([np.mean([h[k] for h in hits if len(h) == len(found)]) for k in range(len(found))])
        print(
            f"pooled {level} %: {100 * every.mean():.1f} % of {len(every)} "
            f"(± {error / np.sqrt(len(found)):.1f}, over replicas)"
        )
    print("| coordinate | 95 % | 99 % | bias | deviation |\n| --- | ---: | ---: | ---: | ---: |")
    for k, name in enumerate(names):
        z = _compute_deviations(found, name)
        shares = [f"{100 * inside[level][k].mean():.1f} %" for level in QUANTILES]
        print(f"| `{name}` | {' | '.join(shares)} | {z.mean():+.2f} | {z.std():.2f} |")


def _find_covered(found: Sequence[dict[str, Any]], name: str, interval: str) -> np.ndarray:
    known = [r["coordinates"][name] for r in found if r["coordinates"][name][interval] is not None]
    return np.array([c[interval][0] <= c["true"] <= c[interval][1] for c in known])


def _compute_deviations(found: Sequence[dict[str, Any]], name: str) -> np.ndarray:
    """Compute estimated minus true values in the standard deviations of the fit, from its 95 % intervals."""
    known = [r["coordinates"][name] for r in found if r["coordinates"][name]["ci95"] is not None]
    return np.array([QUANTILES[95] * 2 * (c["value"] - c["true"]) / (c["ci95"][1] - c["ci95"][0]) for c in known])


if __name__ == "__main__":
    if sys.argv[1] == "run":
        run(sys.argv[2], int(sys.argv[3]), int(sys.argv[4]), Path(sys.argv[5]))
    elif sys.argv[1] == "random":
        run_random(int(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4]))
    else:
        print_table(Path(sys.argv[2]))

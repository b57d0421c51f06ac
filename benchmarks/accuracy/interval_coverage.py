"""Coverage of the intervals on the simulated rig, and errors on validation strokes against the true model.

Each seed draws its own noise, zero shift and clock errors. It records the methods `identification`, which is
fitted, and `validation`, which no fit reads, from the default scenario. Only this benchmark reads the files with
the truth.

    python -m benchmarks.accuracy.interval_coverage [SEEDS [FILE]]
"""

import json
import sys
import time
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from bench.log import Identity
from bench.methods import load_method
from bench.runs import RIG_COMMAND, run_from_plant
from benchmarks.common import cache, print_line
from identification.damper import Coordinates, Parameters, to_coordinates
from identification.documents import Fit
from identification.fitting import assemble, compute_rmse, predict_piece
from identification.logs import Recording, load
from identification.pipeline import identify

SEEDS = 20
TRAINING, VALIDATION = "identification", "validation"


def record_run(
    method: str, seed: int, folder: Path, scenario: str
) -> tuple[Recording, Coordinates, dict[str, float]]:
    """Record a log; return it with the true damper as the log shows it, and the true clock errors [s]."""
    log, truth = folder / f"{method}-{seed}.mcap", folder / f"{method}-{seed}.npz"
    identity = Identity("", "", datetime.fromtimestamp(0, UTC))
    run_from_plant(
        load_method(method), scenario, log, identity, seed=seed, rig=(*RIG_COMMAND, "--truth", str(truth))
    )
    with np.load(truth) as file:
        hidden = json.loads(str(file["info"]))
    true = to_coordinates(Parameters(**hidden["parameters"]))
    # A zero shift of the displacement elongates the accumulator spring, so the log shows another preload.
    true = true._replace(f0=hidden["recorded_f0"] + true.k1 * hidden["channel_errors"]["displacement"]["zero"])
    offsets = {name: errors["offset"] for name, errors in hidden["channel_errors"].items()}
    return load(log), true, {"force_delay": offsets["displacement"] - offsets["force"]}


def compute_deviations(fit: Fit, true: Coordinates) -> dict[str, float]:
    """Compute the error of each identifiable coordinate in standard deviations, from its 99 % interval."""
    found = {}
    for name, e in fit.coordinates.items():
        if e.identifiable and e.ci99 is not None:
            value = getattr(true, name)
            # Intervals can be asymmetric: the half on the side of the true value is used.
            half = e.ci99[1] - e.value if value > e.value else e.value - e.ci99[0]
            found[name] = 2.576 * (value - e.value) / half
    return found


def compute_validation_ratio(fit: Fit, recording: Recording, true: Coordinates) -> float:
    """Return the force error on validation strokes over that of the true damper on the same samples [1]."""
    pieces = assemble([recording]).pieces
    point = fit.to_coordinates()._replace(f0=true.f0)  # each run has its own zero of the load cell
    errors = [np.concatenate([predict_piece(p, c).force - p.force for p in pieces]) for c in (point, true)]
    return compute_rmse(errors[0]) / compute_rmse(errors[1])


def fit_seed(seed: int, scenario: str) -> dict[str, Any]:
    """Fit one seed; return its errors in its own standard deviations, and figures of the fit document."""
    with TemporaryDirectory() as folder:
        recording, true, _ = record_run(TRAINING, seed, Path(folder), scenario)
        began = time.process_time()
        fit = identify([recording])
        spent = time.process_time() - began
        validation, other, _ = record_run(VALIDATION, 1000 + seed, Path(folder), scenario)
    return {
        "seed": seed,
        "deviations": compute_deviations(fit, true),
        "found": {name: e.value / getattr(true, name) - 1.0 for name, e in fit.coordinates.items()},
        "unseen": compute_validation_ratio(fit, validation, other),
        "floor": fit.rmse_n.train / fit.noise_floor_n,
        "seconds": spent,
        "result": fit.result,
    }


def run(seeds: int = SEEDS, results: Path | None = None, scenario: str = "default") -> None:
    """Print coverage and validation errors; a results file keeps one line for each seed and can be continued."""
    rows = cache.read_rows(results)
    for seed in sorted(set(range(seeds)) - {row["seed"] for row in rows}):
        rows.append(fit_seed(seed, scenario))
        cache.append_row(results, rows[-1])
    print(f"coverage: {len(rows)} seeds of scenario {scenario}, {TRAINING} fitted, {VALIDATION} not fitted")
    _print_table(rows)


def _print_table(rows: Sequence[dict[str, Any]]) -> None:
    deviations = np.array([z for row in rows for z in row["deviations"].values()])
    validation, floor, seconds = (np.array([row[key] for row in rows]) for key in ("unseen", "floor", "seconds"))
    print_line("fits with the result `converged`", sum(row["result"] == "converged" for row in rows), "", "")
    print_line(
        "true values inside their 99 % intervals",
        100 * float(np.mean(abs(deviations) <= 2.576)),
        "%",
        "at least 97 %",
    )
    print_line("true values inside their 95 % intervals", 100 * float(np.mean(abs(deviations) <= 1.96)), "%", "")
    print_line("validation force error over the true model's, worst seed", validation.max(), "x", "at most 1.05")
    print_line("validation force error over the true model's, median", float(np.median(validation)), "x", "")
    print_line("force error of the fit over the noise floor, median", float(np.median(floor)), "x", "")
    print_line("processor time of a fit of 82 301 samples, median", float(np.median(seconds)), "s", "")
    print("| coordinate | mean | deviation | outside 95 % | outside 99 % | mean error | deviation over seeds |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    for name in rows[0]["found"]:
        z = np.array([row["deviations"][name] for row in rows if name in row["deviations"]])
        found = 100 * np.array([row["found"][name] for row in rows])
        print(
            f"| `{name}` | {z.mean():.2f} | {z.std():.2f} | {(abs(z) > 1.96).sum()} | {(abs(z) > 2.576).sum()} "
            f"| {found.mean():.2f} % | {found.std():.2f} % |"
        )


if __name__ == "__main__":
    run(int(sys.argv[1]) if sys.argv[1:] else SEEDS, Path(sys.argv[2]) if sys.argv[2:] else None)

"""The whole path on the simulated rig: intervals against hidden truth, and unseen strokes against the true model.

Each seed draws noise, zero shift and clock errors anew, records `identification` and, as the strokes that the
fit never sees, `validation`, from the default scenario. The truth stays in files that only this benchmark reads.

    python -m benchmarks.accuracy.coverage [SEEDS [FILE]]
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
    """A log of a method, the true damper as that log would show it, and the hidden clock errors [s]."""
    log, truth = folder / f"{method}-{seed}.mcap", folder / f"{method}-{seed}.npz"
    identity = Identity("", "", datetime.fromtimestamp(0, UTC))
    run_from_plant(
        load_method(method), scenario, log, identity, seed=seed, rig=(*RIG_COMMAND, "--truth", str(truth))
    )
    with np.load(truth) as file:
        hidden = json.loads(str(file["info"]))
    true = to_coordinates(Parameters(**hidden["parameters"]))
    # A zero of the displacement stretches the accumulator spring by as much, so the log shows another preload.
    true = true._replace(f0=hidden["recorded_f0"] + true.k1 * hidden["channel_errors"]["displacement"]["zero"])
    offsets = {name: errors["offset"] for name, errors in hidden["channel_errors"].items()}
    return load(log), true, {"force_delay": offsets["displacement"] - offsets["force"]}


def compute_deviations(fit: Fit, true: Coordinates) -> dict[str, float]:
    """Error of every identifiable coordinate in its own standard deviations, by the 99 % interval."""
    found = {}
    for name, e in fit.coordinates.items():
        if e.identifiable and e.ci99 is not None:
            value = getattr(true, name)
            # Intervals may be lopsided: the side on which the truth lies counts.
            half = e.ci99[1] - e.value if value > e.value else e.value - e.ci99[0]
            found[name] = 2.576 * (value - e.value) / half
    return found


def compute_validation_ratio(fit: Fit, recording: Recording, true: Coordinates) -> float:
    """Force error on unseen strokes over that of the true damper on the same samples."""
    pieces = assemble([recording]).pieces
    point = fit.to_coordinates()._replace(f0=true.f0)  # the zero of the load cell is drawn anew for each run
    errors = [np.concatenate([predict_piece(p, c).force - p.force for p in pieces]) for c in (point, true)]
    return compute_rmse(errors[0]) / compute_rmse(errors[1])


def fit_seed(seed: int, scenario: str) -> dict[str, Any]:
    """How one fit ended: errors in its own deviations, and what its page says of it."""
    with TemporaryDirectory() as folder:
        recording, true, _ = record_run(TRAINING, seed, Path(folder), scenario)
        began = time.process_time()
        fit = identify([recording])
        spent = time.process_time() - began
        unseen, other, _ = record_run(VALIDATION, 1000 + seed, Path(folder), scenario)
    return {
        "seed": seed,
        "deviations": compute_deviations(fit, true),
        "found": {name: e.value / getattr(true, name) - 1.0 for name, e in fit.coordinates.items()},
        "unseen": compute_validation_ratio(fit, unseen, other),
        "floor": fit.rmse_n.train / fit.noise_floor_n,
        "seconds": spent,
        "result": fit.result,
    }


def run(seeds: int = SEEDS, results: Path | None = None, scenario: str = "default") -> None:
    """Print coverage and unseen errors; with a file, results are kept a line each and a later call goes on."""
    rows = cache.read_rows(results)
    for seed in sorted(set(range(seeds)) - {row["seed"] for row in rows}):
        rows.append(fit_seed(seed, scenario))
        cache.append_row(results, rows[-1])
    print(f"coverage: {len(rows)} seeds of scenario {scenario}, {TRAINING} fitted, {VALIDATION} unseen")
    _print_table(rows)


def _print_table(rows: Sequence[dict[str, Any]]) -> None:
    every = np.array([z for row in rows for z in row["deviations"].values()])
    unseen, floor, seconds = (np.array([row[key] for row in rows]) for key in ("unseen", "floor", "seconds"))
    print_line("fits that end in `converged` alone", sum(row["result"] == "converged" for row in rows), "", "")
    print_line(
        "true values inside their 99 % intervals", 100 * float(np.mean(abs(every) <= 2.576)), "%", "at least 97 %"
    )
    print_line("true values inside their 95 % intervals", 100 * float(np.mean(abs(every) <= 1.96)), "%", "")
    print_line("unseen force error over the true model's, worst seed", unseen.max(), "x", "at most 1.05")
    print_line("unseen force error over the true model's, median", float(np.median(unseen)), "x", "")
    print_line("force error of the fit over the noise floor, median", float(np.median(floor)), "x", "")
    print_line("processor time of a fit of 82 301 samples, median", float(np.median(seconds)), "s", "")
    print(
        "| coordinate | mean | spread | outside 95 % | outside 99 % | found over true, mean | spread over seeds |"
    )
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    for name in rows[0]["found"]:
        z = np.array([row["deviations"][name] for row in rows if name in row["deviations"]])
        found = 100 * np.array([row["found"][name] for row in rows])
        print(
            f"| `{name}` | {z.mean():.2f} | {z.std():.2f} | {(abs(z) > 1.96).sum()} | {(abs(z) > 2.576).sum()} "
            f"| {found.mean():.2f} % | {found.std():.2f} % |"
        )


if __name__ == "__main__":
    run(*(int(a) for a in sys.argv[1:2]), *(Path(a) for a in sys.argv[2:3]))

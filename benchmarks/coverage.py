"""The whole path on the simulated rig: intervals against hidden truth, and unseen strokes against the true model.

Each seed draws noise, zero shift and clock errors anew, records `identification` and, as the strokes that the
fit never sees, `validation`, from the default scenario. The truth stays in files that only this benchmark reads.

    python -m benchmarks.coverage [SEEDS [FILE]]
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

from bench.methods import load_method
from bench.rig_process import RIG
from bench.run_from_plant import Identity, run_from_plant
from benchmarks import kept
from benchmarks.timing import line
from identification.assemble import assemble
from identification.damper.coordinates import Coordinates, to_coordinates
from identification.damper.parameters import Parameters
from identification.identify import identify
from identification.prediction import predict_piece, rmse
from identification.recordings import Recording, load
from identification.results import Fit

SEEDS = 20
TRAINING, UNSEEN = "identification", "validation"


def record(method: str, seed: int, folder: Path, scenario: str) -> tuple[Recording, Coordinates, dict[str, float]]:
    """A log of a method, the true damper as that log would show it, and the hidden clock errors [s]."""
    log, truth = folder / f"{method}-{seed}.mcap", folder / f"{method}-{seed}.npz"
    identity = Identity("", "", datetime.fromtimestamp(0, UTC))
    run_from_plant(load_method(method), scenario, log, identity, seed=seed, rig=(*RIG, "--truth", str(truth)))
    with np.load(truth) as file:
        hidden = json.loads(str(file["info"]))
    true = to_coordinates(Parameters(**hidden["parameters"]))
    # A zero of the displacement stretches the accumulator spring by as much, so the log shows another preload.
    true = true._replace(f0=hidden["recorded_f0"] + true.k1 * hidden["drawn"]["displacement"]["zero"])
    offsets = {name: drawn["offset"] for name, drawn in hidden["drawn"].items()}
    return load(log), true, {"force_delay": offsets["displacement"] - offsets["force"]}


def deviations(fit: Fit, true: Coordinates) -> dict[str, float]:
    """Error of every identifiable coordinate in its own standard deviations, by the 99 % interval."""
    found = {}
    for name, e in fit.coordinates.items():
        if e.identifiable and e.ci99 is not None:
            value = getattr(true, name)
            # Intervals may be lopsided: the side on which the truth lies counts.
            half = e.ci99[1] - e.value if value > e.value else e.value - e.ci99[0]
            found[name] = 2.576 * (value - e.value) / half
    return found


def unseen_ratio(fit: Fit, recording: Recording, true: Coordinates) -> float:
    """Force error on unseen strokes over that of the true damper on the same samples."""
    pieces = assemble([recording]).pieces
    point = fit.point()._replace(f0=true.f0)  # the zero of the load cell is drawn anew for each run
    errors = [np.concatenate([predict_piece(p, c).force - p.force for p in pieces]) for c in (point, true)]
    return rmse(errors[0]) / rmse(errors[1])


def fitted(seed: int, scenario: str) -> dict[str, Any]:
    """How one fit ended: errors in its own deviations, and what its page says of it."""
    with TemporaryDirectory() as folder:
        recording, true, _ = record(TRAINING, seed, Path(folder), scenario)
        began = time.process_time()
        fit = identify([recording])
        spent = time.process_time() - began
        unseen, other, _ = record(UNSEEN, 1000 + seed, Path(folder), scenario)
    return {
        "seed": seed,
        "deviations": deviations(fit, true),
        "found": {name: e.value / getattr(true, name) - 1.0 for name, e in fit.coordinates.items()},
        "unseen": unseen_ratio(fit, unseen, other),
        "floor": fit.rmse_n.train / fit.noise_floor_n,
        "seconds": spent,
        "result": fit.result,
    }


def run(seeds: int = SEEDS, results: Path | None = None, scenario: str = "default") -> None:
    """Print coverage and unseen errors; with a file, results are kept a line each and a later call goes on."""
    rows = kept.rows(results)
    for seed in sorted(set(range(seeds)) - {row["seed"] for row in rows}):
        rows.append(fitted(seed, scenario))
        kept.keep_row(results, rows[-1])
    print(f"coverage: {len(rows)} seeds of scenario {scenario}, {TRAINING} fitted, {UNSEEN} unseen")
    _table(rows)


def _table(rows: Sequence[dict[str, Any]]) -> None:
    every = np.array([z for row in rows for z in row["deviations"].values()])
    unseen, floor, seconds = (np.array([row[key] for row in rows]) for key in ("unseen", "floor", "seconds"))
    line("fits that end in `converged` alone", sum(row["result"] == "converged" for row in rows), "", "")
    line(
        "true values inside their 99 % intervals", 100 * float(np.mean(abs(every) <= 2.576)), "%", "at least 97 %"
    )
    line("true values inside their 95 % intervals", 100 * float(np.mean(abs(every) <= 1.96)), "%", "")
    line("unseen force error over the true model's, worst seed", unseen.max(), "x", "at most 1.05")
    line("unseen force error over the true model's, median", float(np.median(unseen)), "x", "")
    line("force error of the fit over the noise floor, median", float(np.median(floor)), "x", "")
    line("processor time of a fit of 82 301 samples, median", float(np.median(seconds)), "s", "")
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

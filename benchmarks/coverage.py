"""The whole path on the simulated rig: intervals against hidden truth, and unseen strokes against the true model.

Each seed draws noise, zero shift and clock errors anew, records `identification` and, as the strokes that the
fit never sees, `validation`, from the default scenario. The truth stays in files that only this benchmark reads.
"""

import json
import sys
import time
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from bench.methods import load_method
from bench.rig_process import RIG
from bench.run_from_plant import Identity, run_from_plant
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
            half = e.ci99[1] - e.value if value > e.value else e.value - e.ci99[0]
            found[name] = 2.576 * (value - e.value) / half
    return found


def unseen_ratio(fit: Fit, recording: Recording, true: Coordinates) -> float:
    """Force error on unseen strokes over that of the true damper on the same samples."""
    pieces = assemble([recording]).pieces
    point = fit.point()._replace(f0=true.f0)  # the zero of the load cell is drawn anew for each run
    errors = [np.concatenate([predict_piece(p, c).force - p.force for p in pieces]) for c in (point, true)]
    return rmse(errors[0]) / rmse(errors[1])


def run(seeds: int = SEEDS, scenario: str = "default") -> None:
    """Print coverage and unseen errors."""
    rows, ratios, floors, spent = [], [], [], []
    with TemporaryDirectory() as folder:
        for seed in range(seeds):
            recording, true, _ = record(TRAINING, seed, Path(folder), scenario)
            began = time.process_time()
            fit = identify([recording])
            spent.append(time.process_time() - began)
            rows.append(deviations(fit, true))
            floors.append((fit.rmse_n.train, fit.noise_floor_n))
            unseen, true, _ = record(UNSEEN, 1000 + seed, Path(folder), scenario)
            ratios.append(unseen_ratio(fit, unseen, true))
    inside = [abs(z) <= 2.576 for row in rows for z in row.values()]
    inside95 = [abs(z) <= 1.96 for row in rows for z in row.values()]
    print(f"coverage: {seeds} seeds of scenario {scenario}, {TRAINING} fitted, {UNSEEN} unseen")
    line("true values inside their 99 % intervals", 100 * float(np.mean(inside)), "%", "at least 97 %")
    line("true values inside their 95 % intervals", 100 * float(np.mean(inside95)), "%", "")
    line("unseen force error over the true model's, worst seed", max(ratios), "x", "at most 1.05")
    line("unseen force error over the true model's, median", float(np.median(ratios)), "x", "")
    line(
        "force error of the fit over the noise floor, median",
        float(np.median([r / f for r, f in floors])),
        "x",
        "",
    )
    line("processor time of a fit of 82 301 samples, median", float(np.median(spent)), "s", "")
    for name in rows[0]:
        z = np.array([row[name] for row in rows if name in row])
        line(f"  {name}: true minus found in deviations, mean and spread", z.mean(), "", f"{z.std():.2f}")


if __name__ == "__main__":
    run(*(int(a) for a in sys.argv[1:2]))

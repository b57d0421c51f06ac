"""Dampers of the demo: how often the diagnosis names the hidden effect, and what the twin reaches.

    python -m benchmarks.accuracy.hidden_effects FOLDER [--seeds FIRST LAST] [--method NAME]

The damper of each seed is recorded directly from the plant, with the six-drive sine method and the validation
strokes. It is diagnosed, and its twin predicts the validation strokes. The result is a table. Files in FOLDER are
kept, and a later call continues.
"""

import argparse
from pathlib import Path
from typing import Any

import orjson

from bench.report import format_force, format_percent, judge, read_diagnosis, read_prediction, read_truth
from benchmarks.common import run_mrbench
from sim_rig.hidden_effect import draw_scenario, make_truth, write_truth

_VALIDATION_SEED_OFFSET = 1000
"""Offset of the seed of the validation strokes, which have their own noise, clock errors and zero."""
_HEADINGS = (
    "seed",
    "effect",
    "named",
    "probability",
    "law, held out",
    "law, second run",
    "twin",
    "floor",
    "judged",
)


def main() -> None:
    """Run the missing seeds and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", nargs=2, type=int, default=(1, 10), metavar=("FIRST", "LAST"))
    parser.add_argument("--method", default="six_voltages")
    options = parser.parse_args()
    rows = []
    for seed in range(options.seeds[0], options.seeds[1] + 1):
        folder = options.folder / f"{options.method}_{seed}"
        folder.mkdir(parents=True, exist_ok=True)
        run_seed(folder, seed, options.method)
        rows.append(make_row(folder))
    for row in (_HEADINGS, ("---",) * len(_HEADINGS), *rows):
        print(f"| {' | '.join(row)} |")
    right = sum(row[-1] == "right" for row in rows)
    print(f"\n{right} of {len(rows)} named right")


def run_seed(folder: Path, seed: int, method: str) -> None:
    """Record, diagnose and predict one drawn damper; steps whose file exists are skipped."""
    truth, scenario = folder / "truth.json", folder / "scenario.json"
    if not truth.exists():
        drawn = make_truth(draw_scenario(seed))
        scenario.write_bytes(orjson.dumps(drawn.scenario))
        write_truth(truth, drawn)
    log, validation, diagnosis = folder / "run.mcap", folder / "validation.mcap", folder / "diagnosis.json"
    _make(log, "run", method, "--scenario", scenario)
    _make(validation, "run", "validation", "--scenario", scenario, "--seed", seed + _VALIDATION_SEED_OFFSET)
    _make(diagnosis, "diagnose", log, "--twin", folder / "twin.json")
    _make(folder / "prediction.json", "predict", folder / "twin.json", validation, "--free", "offset")


def make_row(folder: Path) -> tuple[str, ...]:
    """Return the row of one damper as text."""
    truth, diagnosis = read_truth(folder / "truth.json"), read_diagnosis(folder / "diagnosis.json")
    unseen = read_prediction(folder / "prediction.json")
    before = unseen.rmse_n if unseen.before_n is None else unseen.before_n
    forces = (diagnosis.gap.before_n, before, unseen.rmse_n, unseen.noise_floor_n)
    named = " and ".join(effect.name for effect in diagnosis.effects) or "–"
    judgement = judge(diagnosis, truth)
    judged = "right" if judgement.severity == "good" else judgement.text
    probability = format_percent(diagnosis.probability)
    return (str(truth.seed), truth.effect, named, probability, *map(format_force, forces), judged)


def _make(out: Path, *arguments: Any) -> None:
    """Run a command that writes a file, unless the file exists."""
    if not out.exists():
        run_mrbench(*arguments, "--out", out)


if __name__ == "__main__":
    main()

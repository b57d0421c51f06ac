"""Accuracy of the networks against known truth: validation force error, parameters in Cramér-Rao deviations, time.

    python -m benchmarks pinn                                  all parts; takes hours on a busy machine
    python -m benchmarks.pinn.networks elements dampers        some parts
    python -m benchmarks.pinn.networks elements dampers --preset tuned.json

The first three parts accept another preset of the network `elements`. `MRBENCH_SHARED` names the folder with the
recordings of real dampers; without it that part is skipped.
"""

import os
from argparse import ArgumentParser
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.common import Workspace, print_line
from benchmarks.pinn.cases import (
    LABORATORY,
    Score,
    make_case_problem,
    make_random_recording,
    score_training,
    train_preset,
)
from benchmarks.speed import draw_damper
from identification.fitting import OptimiserSettings, assemble, compute_rmse, predict_piece
from identification.pinn import train_batch
from identification.pinn.common import DenseSettings, read_settings
from identification.pipeline import FitRequest, identify

SEEDS, DAMPERS = 10, 100
STEPS = 28
"""Number of Gauss-Newton steps for a measurement of time; all steps take the same time."""
_ROW = "  {:>6} {:>10.4f} {:>10.2f} {:>9.1f} {:>9} {:>12.3f} {:>12.3f}"
_HEAD = "  {:>6} {:>10} {:>10} {:>9} {:>9} {:>12} {:>12}".format(
    "seed", "validation", "pooled", "s", "accepted", "own force", "simulated"
)


def _print_scores(title: str, scores: Iterable[tuple[int, Score]]) -> list[Score]:
    """Print each score with its seed as soon as it is computed; return all scores."""
    print(f"{title}\n{_HEAD}", flush=True)
    found = []
    for seed, s in scores:
        word = "yes" if s.accepted else "no"
        print(
            _ROW.format(seed, s.ratio, s.pooled_error, s.seconds, word, s.reconstruction, s.simulation), flush=True
        )
        found.append(s)
    return found


def _print_summary(scores: list[Score], ratio: float, pooled: float, seconds: float) -> None:
    """Print how many scores meet each limit."""
    of = f"of {len(scores)}"
    print_line(f"validation error at most {ratio}", sum(s.ratio <= ratio for s in scores), of, "")
    print_line(f"pooled error at most {pooled}", sum(s.pooled_error <= pooled for s in scores), of, "")
    print_line(f"at most {seconds} s", sum(s.seconds <= seconds for s in scores), of, "")
    print_line(
        "largest validation error, largest pooled error",
        max(s.ratio for s in scores),
        f"{max(s.pooled_error for s in scores):.2f}",
        "",
    )
    print_line("median and longest time", float(np.median([s.seconds for s in scores])), "s",
         f"{max(s.seconds for s in scores):.1f} s")  # fmt: skip


def run_elements(preset: str = "elements") -> None:
    """Train preset ``elements`` or another one of its network on six voltages."""
    scores = ((seed, train_preset(preset, LABORATORY, seed)) for seed in range(SEEDS))
    _print_summary(_print_scores(f"{preset}, six voltages (12 s)", scores), 1.005, 1.5, 5.0)


def run_pairs(preset: str = "elements") -> None:
    """Train the preset on four pairs of amplitude and frequency."""
    scores = ((seed, train_preset(preset, LABORATORY, seed, pairs=True)) for seed in range(SEEDS))
    _print_summary(_print_scores(f"{preset}, four pairs (56 s)", scores), 1.005, 1.5, 30.0)


def run_dampers(preset: str = "elements") -> None:
    """Train the preset on random dampers."""
    scores = ((seed, train_preset(preset, draw_damper(seed), seed)) for seed in range(DAMPERS))
    found = _print_scores(f"{preset}, random dampers, six voltages", scores)
    _print_summary(found, 1.02, 2.5, 30.0)
    accepted = [s for s in found if s.accepted]
    print_line("accepted by the network itself", len(accepted), f"of {len(found)}", "")
    print_line(
        "of these, validation error at most 1.02",
        sum(s.ratio <= 1.02 for s in accepted),
        f"of {len(accepted)}",
        "",
    )


def run_dense() -> None:
    """Train preset ``dense`` on six voltages."""
    scores = ((seed, train_preset("dense", LABORATORY, seed)) for seed in range(SEEDS))
    _print_summary(_print_scores("dense, six voltages (12 s)", scores), 1.03, 4.0, 120.0)


def run_batches() -> None:
    """Train preset ``dense`` on many dampers at once: time over that of separate trainings, and ten scores."""
    settings = read_settings("dense")
    assert isinstance(settings, DenseSettings)
    short = settings.model_copy(update={"steps": STEPS})
    for count in (1, 4, 16):
        problems = [make_case_problem(LABORATORY, seed) for seed in range(count)]
        together = sum(found.seconds for found in train_batch(problems, short))
        alone = sum(train_batch([problem], short)[0].seconds for problem in problems)
        label = f"{count} at once, {STEPS} of {settings.steps} steps: {together:.1f} s; separately {alone:.1f} s"
        print_line(label, together / alone, "x", "")
    problems = [make_case_problem(LABORATORY, seed) for seed in range(SEEDS)]
    scores = (
        (seed, score_training(found, LABORATORY, problems[seed], problems[seed], seed))
        for seed, found in enumerate(train_batch(problems, settings))
    )
    _print_summary(_print_scores("dense, six voltages, ten seeds of noise in one batch", scores), 1.03, 4.0, 120.0)


def run_paper() -> None:
    """Train preset ``paper`` on six voltages."""
    scores = ((seed, train_preset("paper", LABORATORY, seed)) for seed in range(2))
    _print_scores("paper, six voltages (12 s)", scores)


def run_displacement() -> None:
    """Compare stages pinn and refine on a random displacement with noise, by the error on another recording."""
    print("random displacement, 5 µm of noise: validation error of pinn over that of refine")
    for seed in range(3):
        fits = [
            identify(
                [make_random_recording(seed)], FitRequest(settings=OptimiserSettings(seed=seed), stages=(stage,))
            )
            for stage in ("pinn", "refine")
        ]
        pieces = assemble([make_random_recording(seed + 100)]).pieces
        errors = [
            compute_rmse(np.concatenate([predict_piece(p, fit.to_coordinates()).force - p.force for p in pieces]))
            for fit in fits
        ]
        print_line(f"seed {seed}, {fits[0].stages[0].seconds:.0f} s", errors[0] / errors[1], "x", "at most 1.05")


_REAL_DAMPERS = {
    "utfsm": (
        "utfsm_sine/*.csv.gz",
        "--drive-kind coil_a",
        "--hold-out '5mm_4Hz*,25mm_0.5Hz*' --delay-prior 0.01",
    ),
    "nees": ("nees_dyke/ranran_50.csv.gz", "--drive-kind driver_command_v", "--hold-out-after 0.6"),
}


def run_real() -> None:
    """Compare stages pinn and refine on held-out strokes of two real dampers."""
    shared = os.environ.get("MRBENCH_SHARED")
    if not shared:
        print("real dampers: skipped, MRBENCH_SHARED is not set")
        return
    with TemporaryDirectory() as folder:
        workspace = Workspace(Path(folder))
        for name, (files, columns, options) in _REAL_DAMPERS.items():
            workspace.run(f"mrbench import {shared}/data/{files} --out {name}.mcap {columns}")
            errors = []
            for stage in ("pinn", "refine"):
                workspace.run(f"mrbench identify {name}.mcap {options} --stages {stage} --out {name}-{stage}.json")
                fit = workspace.read_document(f"{name}-{stage}")
                errors.append(fit["rmse_n"]["held_out"])
                print(f"  {name} {stage}: {fit['stages'][0]['seconds']:.0f} s, {fit['result']}")
            print_line(
                f"{name}: held-out error of pinn over that of refine", errors[0] / errors[1], "x", "at most 1.05"
            )


PRESET_PARTS: dict[str, Callable[[str], None]] = {
    "elements": run_elements, "pairs": run_pairs, "dampers": run_dampers,
}  # fmt: skip
PARTS: dict[str, Callable[[], None]] = {
    "dense": run_dense, "batches": run_batches, "paper": run_paper, "displacement": run_displacement,
    "real": run_real,
}  # fmt: skip


def run(names: Sequence[str] = (), preset: str = "elements") -> None:
    """Run the requested parts, or all."""
    for name in names or (*PRESET_PARTS, *PARTS):
        if name in PRESET_PARTS:
            PRESET_PARTS[name](preset)
        else:
            PARTS[name]()


if __name__ == "__main__":
    parser = ArgumentParser(description="Accuracy of the networks against known truth.")
    parser.add_argument("names", nargs="*", metavar="PART", help=", ".join([*PRESET_PARTS, *PARTS]))
    parser.add_argument("--preset", default="elements", help="preset of the network `elements`, or its file")
    options = parser.parse_args()
    run(options.names, options.preset)

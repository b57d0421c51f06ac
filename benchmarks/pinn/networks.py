"""The networks against known truth: unseen force, parameters in Cramér-Rao deviations, time.

    python -m benchmarks pinn                     all parts; takes hours on a busy machine
    python -m benchmarks.pinn.networks local dampers       some of them
    python -m benchmarks.pinn.networks local dampers --preset tuned.json

The first three parts take another preset of the local network.
`MRBENCH_SHARED` names the folder with the recordings of real dampers; without it that part is left out.
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
"""Of Gauss-Newton where only the time of a step counts: all of them cost the same."""
_ROW = "  {:>6} {:>10.4f} {:>10.2f} {:>9.1f} {:>9} {:>12.3f} {:>12.3f}"
_HEAD = "  {:>6} {:>10} {:>10} {:>9} {:>9} {:>12} {:>12}".format(
    "seed", "unseen", "pooled", "s", "accepted", "own force", "simulated"
)


def _print_scores(title: str, scores: Iterable[tuple[int, Score]]) -> list[Score]:
    """Scores by their seeds, each printed as it comes."""
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
    """How many of the scores keep within the bars."""
    of = f"of {len(scores)}"
    print_line(f"unseen at most {ratio}", sum(s.ratio <= ratio for s in scores), of, "")
    print_line(f"pooled at most {pooled}", sum(s.pooled_error <= pooled for s in scores), of, "")
    print_line(f"at most {seconds} s", sum(s.seconds <= seconds for s in scores), of, "")
    print_line(
        "worst unseen, worst pooled",
        max(s.ratio for s in scores),
        f"{max(s.pooled_error for s in scores):.2f}",
        "",
    )
    print_line("median and longest time", float(np.median([s.seconds for s in scores])), "s",
         f"{max(s.seconds for s in scores):.1f} s")  # fmt: skip


def run_local(preset: str = "elements") -> None:
    """Preset local or another of its network, six voltages."""
    scores = ((seed, train_preset(preset, LABORATORY, seed)) for seed in range(SEEDS))
    _print_summary(_print_scores(f"{preset}, six voltages (12 s)", scores), 1.005, 1.5, 5.0)


def run_pairs(preset: str = "elements") -> None:
    """The same, four pairs of amplitude and frequency."""
    scores = ((seed, train_preset(preset, LABORATORY, seed, pairs=True)) for seed in range(SEEDS))
    _print_summary(_print_scores(f"{preset}, four pairs (56 s)", scores), 1.005, 1.5, 30.0)


def run_dampers(preset: str = "elements") -> None:
    """The same, random dampers."""
    scores = ((seed, train_preset(preset, draw_damper(seed), seed)) for seed in range(DAMPERS))
    found = _print_scores(f"{preset}, random dampers, six voltages", scores)
    _print_summary(found, 1.02, 2.5, 30.0)
    taken = [s for s in found if s.accepted]
    print_line("accepted by the network's own judgement", len(taken), f"of {len(found)}", "")
    print_line("of these, unseen at most 1.02", sum(s.ratio <= 1.02 for s in taken), f"of {len(taken)}", "")


def run_global() -> None:
    """Preset global, six voltages."""
    scores = ((seed, train_preset("dense", LABORATORY, seed)) for seed in range(SEEDS))
    _print_summary(_print_scores("global, six voltages (12 s)", scores), 1.03, 4.0, 120.0)


def run_batches() -> None:
    """Preset global, many dampers at once: time over that of one by one, and where ten of them end."""
    settings = read_settings("dense")
    assert isinstance(settings, DenseSettings)
    short = settings.model_copy(update={"steps": STEPS})
    for count in (1, 4, 16):
        problems = [make_case_problem(LABORATORY, seed) for seed in range(count)]
        together = sum(found.seconds for found in train_batch(problems, short))
        alone = sum(train_batch([problem], short)[0].seconds for problem in problems)
        words = f"{count} at once, {STEPS} of {settings.steps} steps: {together:.1f} s; one by one {alone:.1f} s"
        print_line(words, together / alone, "x", "")
    problems = [make_case_problem(LABORATORY, seed) for seed in range(SEEDS)]
    scores = (
        (seed, score_training(found, LABORATORY, problems[seed], problems[seed], seed))
        for seed, found in enumerate(train_batch(problems, settings))
    )
    _print_summary(
        _print_scores("global, six voltages, ten seeds of noise in one batch", scores), 1.03, 4.0, 120.0
    )


def run_paper() -> None:
    """Preset paper, six voltages."""
    scores = ((seed, train_preset("paper", LABORATORY, seed)) for seed in range(2))
    _print_scores("paper, six voltages (12 s)", scores)


def run_displacement() -> None:
    """A random displacement with noise: pinn beside refine, on another recording."""
    print("random displacement, 5 µm of noise: unseen error of pinn over that of refine")
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
    """Two real dampers: pinn beside refine on what both did not see."""
    shared = os.environ.get("MRBENCH_SHARED")
    if not shared:
        print("real dampers: left out, MRBENCH_SHARED names no folder")
        return
    with TemporaryDirectory() as folder:
        desk = Workspace(Path(folder))
        for name, (files, how, options) in _REAL_DAMPERS.items():
            desk.run(f"mrbench import {shared}/data/{files} --out {name}.mcap {how}")
            errors = []
            for stage in ("pinn", "refine"):
                desk.run(f"mrbench identify {name}.mcap {options} --stages {stage} --out {name}-{stage}.json")
                fit = desk.read_document(f"{name}-{stage}")
                errors.append(fit["rmse_n"]["held_out"])
                print(f"  {name} {stage}: {fit['stages'][0]['seconds']:.0f} s, {fit['result']}")
            print_line(
                f"{name}: held-out error of pinn over that of refine", errors[0] / errors[1], "x", "at most 1.05"
            )


PRESET_PARTS: dict[str, Callable[[str], None]] = {"local": run_local, "pairs": run_pairs, "dampers": run_dampers}
PARTS: dict[str, Callable[[], None]] = {
    "global": run_global, "many": run_batches, "paper": run_paper, "displacement": run_displacement, "real": run_real,
}  # fmt: skip


def run(names: Sequence[str] = (), preset: str = "elements") -> None:
    """Print the parts asked for, or all."""
    for name in names or (*PRESET_PARTS, *PARTS):
        if name in PRESET_PARTS:
            PRESET_PARTS[name](preset)
        else:
            PARTS[name]()


if __name__ == "__main__":
    asked = ArgumentParser()
    asked.add_argument("names", nargs="*", metavar="PART", help=", ".join([*PRESET_PARTS, *PARTS]))
    asked.add_argument("--preset", default="elements")
    given = asked.parse_args()
    run(given.names, given.preset)

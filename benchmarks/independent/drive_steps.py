"""Instants of drive steps on recordings of the independent simulator, whose steps lie between two samples.

    python -m benchmarks.independent.drive_steps [--recordings 20] [--seed 1]

Recordings are without effects, and their drive steps in motion. The error of the law is relative to the noise of
the force: with the drive as recorded, and with its steps moved. The last column is the error of the estimated
instants over that of the middle of the sample, for the steps that matter most.
"""

from argparse import ArgumentParser
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.independent.strokes import Strokes
from benchmarks.independent.trial import draw_damper, record_case
from identification.arrays import Array
from identification.gap.diagnosis import make_candidate_pool, prepare_recordings
from identification.logs import Recording
from identification.signals import StepShifts
from identification.threads import use_one_thread

_METHODS = ("mixed", "random")
"""Methods whose drive steps in motion."""
_LARGEST_SHARE = 0.5
"""Part of the steps that matter, those with the largest change of the drive [1]."""


def main() -> None:
    """Print the errors of each recording."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    print("| recording | law, as recorded | law, steps moved | error of the instants |\n| --- | --- | --- | --- |")
    seed, found = 1000 * options.seed, 0
    with TemporaryDirectory() as folder:
        while found < options.recordings:
            drawn = draw_damper(np.random.default_rng([seed, 41]))
            if drawn.method in _METHODS:
                case = record_case(seed, "none", Path(folder))
                print(f"| {case.label} | {_measure(case.recording, drawn.scales.strokes)} |", flush=True)
                found += 1
            seed += 1


def _measure(recording: Recording, strokes: Strokes) -> str:
    """Return the cells of one recording."""
    with use_one_thread():
        pool = make_candidate_pool(prepare_recordings([recording]))
        pool.fit_law()
        pool.fit_fully(frozenset())
        before = pool.baseline
        if not pool.place_drive_steps(before):
            return f"{before.train_rmse / pool.floor:.3f} | as recorded | -"
        pool.fit((), [before.fit.minimum.unknowns])
        pool.fit_fully(frozenset())
    shifts = pool.evaluation.pieces[0].step_shifts
    error = _compare(shifts, recording, strokes) if shifts else "-"
    return f"{before.train_rmse / pool.floor:.3f} | {pool.baseline.train_rmse / pool.floor:.3f} | {error}"


def _compare(shifts: StepShifts, recording: Recording, strokes: Strokes) -> str:
    """Return the error of the instants over that of the middle of the sample; both less their mean."""
    drive, true = recording.stretches[0].drive, _average_drive(strokes)
    sizes = drive[shifts.places] - drive[shifts.places - 1]
    advances = (true[shifts.places - 1] - drive[shifts.places - 1]) / sizes
    chosen = np.abs(sizes) >= np.quantile(np.abs(sizes), 1.0 - _LARGEST_SHARE)
    error = (shifts.advances - advances)[chosen]
    return f"{np.std(error) / np.std(advances[chosen]):.2f}"


def _average_drive(strokes: Strokes) -> Array:
    """Return the mean drive after each sample [V or A]."""
    parts = 2 * strokes.stride
    count = (len(strokes.drive) - 1) // parts
    return np.asarray(strokes.drive[: count * parts].reshape(count, parts).mean(axis=1), float)


if __name__ == "__main__":
    main()

"""Instants of drive steps on recordings of the independent simulator, whose steps lie between two samples.

    python -m benchmarks.independent.drive_steps [--recordings 20] [--seed 1]

Recordings are without effects, and their drive steps in motion. The error of the law is relative to its error with
the true instants: with the drive as recorded, and with its steps moved. The last column is the error of the
estimated instants over that of the middle of the sample, for the half of the steps with the largest change.
"""

from argparse import ArgumentParser
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.independent.strokes import Strokes
from benchmarks.independent.trial import draw_damper, record_case
from identification.arrays import Array
from identification.gap.diagnosis import make_candidate_pool, prepare_recordings
from identification.gap.fits import Candidate
from identification.gap.selection import CandidatePool
from identification.logs import Recording
from identification.signals import StepShifts, average_drive_levels, find_level_changes
from identification.threads import use_one_thread
from identification.uncertainty import shift_steps

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
    prepared, true = prepare_recordings([recording]), _find_instants(recording, strokes)
    with use_one_thread():
        pool, known = make_candidate_pool(prepared), make_candidate_pool(prepared)
        known.evaluation = replace(prepared.evaluation, pieces=shift_steps(known.problems.full, [true]).pieces)
        full = replace(known.problems.full, pieces=known.evaluation.pieces)
        known.problems = replace(known.problems, full=full)
        best, recorded = _fit_law(known), _fit_law(pool)
        cell = f"{recorded.train_rmse / best.train_rmse:.3f}"
        if not pool.place_drive_steps(recorded):
            return f"{cell} | as recorded | -"
        moved = _fit_law(pool)
    error = _compare(pool.evaluation.pieces[0].step_shifts, true, recording.stretches[0].drive)
    return f"{cell} | {moved.train_rmse / best.train_rmse:.3f} | {error}"


def _fit_law(pool: CandidatePool) -> Candidate:
    """Return the law, fitted to all samples."""
    pool.fit_law()
    pool.fit_fully(frozenset())
    return pool.baseline


def _find_instants(recording: Recording, strokes: Strokes) -> StepShifts:
    """Return the true shift of each step."""
    drive, true = average_drive_levels(recording.stretches[0].drive), _average_drive(strokes)
    places = find_level_changes(drive)
    return StepShifts(places, (true - drive[: len(true)])[places - 1] / (drive[places] - drive[places - 1]))


def _compare(shifts: StepShifts | None, true: StepShifts, drive: Array) -> str:
    """Return the error of the instants over that of the middle of the sample; both less their mean."""
    if shifts is None:
        return "-"
    sizes = np.abs(drive[shifts.places] - drive[shifts.places - 1])
    chosen = sizes >= np.quantile(sizes, 1.0 - _LARGEST_SHARE)
    error = (shifts.advances - true.advances)[chosen]
    return f"{np.std(error) / np.std(true.advances[chosen]):.2f}"


def _average_drive(strokes: Strokes) -> Array:
    """Return the mean drive after each sample [V or A]."""
    parts = 2 * strokes.stride
    count = (len(strokes.drive) - 1) // parts
    return np.asarray(strokes.drive[: count * parts].reshape(count, parts).mean(axis=1), float)


if __name__ == "__main__":
    main()

"""Check of claimed shrinkages from one stroke on another run of the same kind.

    python -m benchmarks.trial.same_kind trial.json

The trial checks claims of poor methods on strokes at other amplitudes than the recorded ones. Here the twins
predict one more run of the recorded kind: one stroke with newly drawn amplitude, frequency and order of the
drives. An interrupted call can be continued. The results are on the page of `benchmarks.trial.page`.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path

import orjson

from benchmarks.trial.next_stroke import read_seal
from sim_rig.trial.cases import TrialFolder, TrueCase, make_method_document, make_strokes, read_sealed_truth
from sim_rig.trial.execution import MRBENCH, CommandFailedError, run_command
from sim_rig.trial.scoring import compute_force_noise, compute_true_shrinkage, unseal_case

SEED = 15_485_863
"""Offset of the seeds of the strokes and of a case's run."""


def find_claimed_cases(folder: TrialFolder) -> Iterator[TrueCase]:
    """Find cases with effects and a poor method for which a diagnosis claims a shrinkage."""
    for case in read_sealed_truth(folder.truth, read_seal(folder).sha256).cases:
        if case.method == "poor" and case.effects and folder.get_case_files(case.id).twin.exists():
            found = unseal_case(folder, case, case.id)
            if found.claimed_shrinkage and found.named_set and found.named_set.effects:
                yield case


def find_prediction_path(folder: TrialFolder, case: str) -> Path:
    """Return the path of the twin's prediction of that run, `mrbench.prediction/1`."""
    return folder.root / "alike" / f"{case}.json"


def read_same_kind_shrinkage(folder: TrialFolder, case: TrueCase) -> float | None:
    """Return the shrinkage [1] on that run; None if it was not recorded or has no gap."""
    path = find_prediction_path(folder, case.id)
    return (
        compute_true_shrinkage(orjson.loads(path.read_bytes()), compute_force_noise(case))
        if path.exists()
        else None
    )


def record_same_kind(folder: TrialFolder, case: TrueCase, seed: int) -> None:
    """Record one more run of a case's kind, and predict it with the twin."""
    prediction, files = find_prediction_path(folder, case.id), folder.get_case_files(case.id)
    if prediction.exists():
        return
    prediction.parent.mkdir(exist_ok=True)
    method, log = prediction.with_suffix(".method.json"), prediction.with_suffix(".mcap")
    planned = make_strokes("poor", case.damper, seed + SEED, case.variant)
    folder.write_file(method, orjson.dumps(make_method_document("alike", case.damper, planned)).decode())
    log.unlink(missing_ok=True)
    run_seed = str(case.seed + SEED)
    run_command([*MRBENCH, "run", method, "--scenario", files.scenario, "--seed", run_seed, "--out", log])
    run_command([*MRBENCH, "predict", files.twin, log, "--free", "offset", "--out", prediction])


def main() -> None:
    """Record and predict these runs for all cases of a trial."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("trial", type=Path, help="document of `mrbench trial`; its folder is in the same place")
    folder = TrialFolder(parser.parse_args().trial)
    seed = read_seal(folder).seed
    for case in find_claimed_cases(folder):
        try:
            record_same_kind(folder, case, seed)
        except CommandFailedError as error:
            print(f"{case.id}: {error}", flush=True)


if __name__ == "__main__":
    main()

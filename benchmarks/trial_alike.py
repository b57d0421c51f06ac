"""What a claim from one stroke is worth on another run of its kind: `python -m benchmarks.trial_alike trial.json`.

The trial holds claims of poor methods against strokes at other amplitudes than were recorded. Here the twins
predict one more run of the kind that was recorded: one stroke, its amplitude, frequency and order of the drives
drawn anew. A run that was stopped goes on; the page of `benchmarks.trial` has the figures.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path

import orjson

from benchmarks.trial_next import sealed
from sim_rig.trial.folder import TrialFolder
from sim_rig.trial.processes import MRBENCH, CommandFailedError, call
from sim_rig.trial.strokes import method_document, strokes
from sim_rig.trial.truth import TrueCase, read_sealed
from sim_rig.trial.unseal import force_noise, true_shrinkage, unsealed

SEED = 15_485_863
"""Added to the seeds of the trial's strokes and of a case's run."""


def claimed_cases(folder: TrialFolder) -> Iterator[TrueCase]:
    """Cases with effects under a poor method for which a diagnosis claims a shrinkage."""
    for case in read_sealed(folder.truth, sealed(folder).sha256).cases:
        if case.method == "poor" and case.effects and folder.files(case.id).twin.exists():
            found = unsealed(folder, case, case.id)
            if found.claimed_shrinkage and found.named and found.named.effects:
                yield case


def prediction(folder: TrialFolder, case: str) -> Path:
    """What the twin leaves on that run, `mrbench.prediction/1`."""
    return folder.root / "alike" / f"{case}.json"


def shrunk_there(folder: TrialFolder, case: TrueCase) -> float | None:
    """Shrinkage [1] on that run; None where it has not been made, or there is nothing to shrink."""
    path = prediction(folder, case.id)
    return true_shrinkage(orjson.loads(path.read_bytes()), force_noise(case)) if path.exists() else None


def make(folder: TrialFolder, case: TrueCase, seed: int) -> None:
    """Record one more run of a case's kind, and let the twin predict it."""
    answer, files = prediction(folder, case.id), folder.files(case.id)
    if answer.exists():
        return
    answer.parent.mkdir(exist_ok=True)
    method, log = answer.with_suffix(".method.json"), answer.with_suffix(".mcap")
    planned = strokes("poor", case.damper, seed + SEED, case.variant)
    folder.put(method, orjson.dumps(method_document("alike", case.damper, planned)).decode())
    log.unlink(missing_ok=True)
    seeded = str(case.seed + SEED)
    call([*MRBENCH, "run", method, "--scenario", files.scenario, "--seed", seeded, "--out", log])
    call([*MRBENCH, "predict", files.twin, log, "--free", "offset", "--out", answer])


def main() -> None:
    """Make these runs for all cases of a trial."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("trial", type=Path, help="the answer of `mrbench trial`; its folder stands beside it")
    folder = TrialFolder(options.parse_args().trial)
    seed = sealed(folder).seed
    for case in claimed_cases(folder):
        try:
            make(folder, case, seed)
        except CommandFailedError as error:
            print(f"{case.id}: {error}", flush=True)


if __name__ == "__main__":
    main()

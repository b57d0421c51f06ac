"""Recording and diagnosis of the strokes that diagnoses of a blind trial proposed.

    python -m benchmarks.trial.next_stroke trial.json

Each case of a poor method whose diagnosis proposed a stroke is recorded again on this stroke. Both recordings are
diagnosed together, and the named effects are compared with the truth. An interrupted call can be continued. The
results are on the page of `benchmarks.trial.page`.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import orjson

from sim_rig.trial.cases import Seal, TrialFolder, TrueCase, read_sealed_truth
from sim_rig.trial.execution import DIAGNOSE, MRBENCH, CommandFailedError, run_command
from sim_rig.trial.scoring import CaseResult, unseal_case

SEED = 104_729
"""Offset of the seed of a case for the run on the proposed stroke."""


def read_seal(folder: TrialFolder) -> Seal:
    """Read the seal of a trial.

    Raises:
        SystemExit: no trial has been sealed in the folder.
    """
    seal = folder.read_seal()
    if seal is None:
        raise SystemExit(f"{folder.root}: no trial has been sealed there; run `mrbench trial` first")
    return seal


def find_open_cases(folder: TrialFolder) -> Iterator[tuple[TrueCase, CaseResult]]:
    """Find cases with library effects and a poor method whose diagnosis proposed a stroke."""
    for case in read_sealed_truth(folder.truth, read_seal(folder).sha256).cases:
        if case.method == "poor" and case.kind in ("single", "pair", "triple") and folder.read_outcome(case.id):
            found = unseal_case(folder, case, case.id)
            if found.failure is None and _read_proposal(folder, case.id) is not None:
                yield case, found


def read_second_diagnosis(folder: TrialFolder, case: TrueCase) -> tuple[str, ...] | None:
    """Return the effects named from both recordings, sorted; None if the stroke has not been recorded."""
    path = _find_diagnosis_path(folder, case.id)
    if not path.exists():
        return None
    return tuple(sorted(effect["name"] for effect in orjson.loads(path.read_bytes())["effects"]))


def record_proposal(folder: TrialFolder, case: TrueCase) -> None:
    """Record the proposed stroke of a case, and diagnose it together with the first recording."""
    diagnosis, log = _find_diagnosis_path(folder, case.id), folder.root / "next" / f"{case.id}.mcap"
    if diagnosis.exists():
        return
    diagnosis.parent.mkdir(exist_ok=True)
    files, method = folder.get_case_files(case.id), diagnosis.with_suffix(".method.json")
    known = orjson.loads(folder.get_method_path(f"{case.method}_{case.damper}_{case.variant}").read_bytes())
    stroke = {**known, "name": "next", "segments": [_read_proposal(folder, case.id)]}
    folder.write_file(method, orjson.dumps(stroke).decode())
    partial = diagnosis.with_suffix(".partial.json")
    if not log.exists():
        unfinished = log.with_suffix(".partial.mcap")
        unfinished.unlink(missing_ok=True)
        seed = str(case.seed + SEED)
        run_command([*MRBENCH, "run", method, "--scenario", files.scenario, "--seed", seed, "--out", unfinished])
        unfinished.replace(log)
    run_command([*DIAGNOSE, files.log, log, "--out", partial])
    partial.replace(diagnosis)


def _find_diagnosis_path(folder: TrialFolder, case: str) -> Path:
    return folder.root / "next" / f"{case}.json"


def _read_proposal(folder: TrialFolder, case: str) -> dict[str, Any] | None:
    """Return the segment that a diagnosis proposed, or None."""
    proposed = orjson.loads(folder.get_case_files(case).diagnosis.read_bytes())["next_stroke"]
    return None if proposed is None else dict(proposed["segment"])


def main() -> None:
    """Record the strokes that the diagnoses of a trial proposed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("trial", type=Path, help="document of `mrbench trial`; its folder is in the same place")
    folder = TrialFolder(parser.parse_args().trial)
    for case, before in find_open_cases(folder):
        try:
            record_proposal(folder, case)
        except CommandFailedError as error:
            print(f"{case.id}: {error}")
            continue
        named = before.named_set.effects if before.named_set else ()
        print(f"{case.id}: {before.truth}, named {named}, then {read_second_diagnosis(folder, case)}", flush=True)


if __name__ == "__main__":
    main()

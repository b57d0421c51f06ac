"""Records the strokes that diagnoses proposed: `python -m benchmarks.trial.next_stroke trial.json`.

Every case of a poor method whose diagnosis left sets open is recorded once more on the stroke that it proposed;
both recordings are diagnosed together, and what stands at the top then is compared with the truth. A run that was
stopped goes on; the page of `benchmarks.trial.page` has the figures.
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
"""Added to a case's seed for the run on the proposed stroke."""


def read_seal(folder: TrialFolder) -> Seal:
    """What the folder of a trial was sealed with."""
    seal = folder.read_seal()
    if seal is None:
        raise SystemExit(f"{folder.root}: no trial has been sealed there; run `mrbench trial` first")
    return seal


def find_open_cases(folder: TrialFolder) -> Iterator[tuple[TrueCase, CaseResult]]:
    """Cases with known effects under a poor method whose diagnosis proposed a stroke."""
    for case in read_sealed_truth(folder.truth, read_seal(folder).sha256).cases:
        if case.method == "poor" and case.kind in ("single", "pair", "triple") and folder.read_outcome(case.id):
            found = unseal_case(folder, case, case.id)
            if found.failure is None and _read_proposal(folder, case.id) is not None:
                yield case, found


def read_second_answer(folder: TrialFolder, case: TrueCase) -> tuple[str, ...] | None:
    """What is named from both recordings, sorted; None while the stroke has not been made."""
    path = _find_answer_path(folder, case.id)
    if not path.exists():
        return None
    return tuple(sorted(effect["name"] for effect in orjson.loads(path.read_bytes())["effects"]))


def record_proposal(folder: TrialFolder, case: TrueCase) -> None:
    """Record the proposed stroke of a case, and diagnose it together with the first recording."""
    answer, log = _find_answer_path(folder, case.id), folder.root / "next" / f"{case.id}.mcap"
    if answer.exists():
        return
    answer.parent.mkdir(exist_ok=True)
    files, method = folder.get_case_files(case.id), answer.with_suffix(".method.json")
    known = orjson.loads(folder.get_method_path(f"{case.method}_{case.damper}_{case.variant}").read_bytes())
    stroke = {**known, "name": "next", "segments": [_read_proposal(folder, case.id)]}
    folder.write_file(method, orjson.dumps(stroke).decode())
    partial = answer.with_suffix(".partial.json")
    if not log.exists():
        half = log.with_suffix(".partial.mcap")
        half.unlink(missing_ok=True)
        seed = str(case.seed + SEED)
        run_command([*MRBENCH, "run", method, "--scenario", files.scenario, "--seed", seed, "--out", half])
        half.replace(log)
    run_command([*DIAGNOSE, files.log, log, "--out", partial])
    partial.replace(answer)


def _find_answer_path(folder: TrialFolder, case: str) -> Path:
    return folder.root / "next" / f"{case}.json"


def _read_proposal(folder: TrialFolder, case: str) -> dict[str, Any] | None:
    """The segment that a diagnosis asks for."""
    proposed = orjson.loads(folder.get_case_files(case).diagnosis.read_bytes())["next_stroke"]
    return None if proposed is None else dict(proposed["segment"])


def main() -> None:
    """Make the strokes that the diagnoses of a trial asked for."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("trial", type=Path, help="the answer of `mrbench trial`; its folder stands beside it")
    folder = TrialFolder(options.parse_args().trial)
    for case, before in find_open_cases(folder):
        try:
            record_proposal(folder, case)
        except CommandFailedError as error:
            print(f"{case.id}: {error}")
            continue
        named = before.named_set.effects if before.named_set else ()
        print(f"{case.id}: {before.truth}, named {named}, then {read_second_answer(folder, case)}", flush=True)


if __name__ == "__main__":
    main()

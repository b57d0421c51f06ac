"""The stroke that a diagnosis asks for, made: `python -m benchmarks.trial_next trial.json`, after `mrbench trial`.

Every case of a poor method whose diagnosis left sets open is recorded once more on the stroke that it proposed;
both recordings are diagnosed together, and what stands at the top then is compared with the truth. A run that was
stopped goes on; the page of `benchmarks.trial` has the figures.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import orjson

from sim_rig.trial.answer import CaseAnswer
from sim_rig.trial.folder import Seal, TrialFolder
from sim_rig.trial.processes import MRBENCH, CommandFailedError, call
from sim_rig.trial.run import DIAGNOSE
from sim_rig.trial.truth import TrueCase, read_sealed
from sim_rig.trial.unseal import unsealed

SEED = 104_729
"""Added to a case's seed for the run on the proposed stroke."""


def sealed(folder: TrialFolder) -> Seal:
    """What the folder of a trial was sealed with."""
    seal = folder.seal()
    if seal is None:
        raise SystemExit(f"{folder.root}: no trial has been sealed there; run `mrbench trial` first")
    return seal


def open_cases(folder: TrialFolder) -> Iterator[tuple[TrueCase, CaseAnswer]]:
    """Cases with known effects under a poor method whose diagnosis proposed a stroke."""
    for case in read_sealed(folder.truth, sealed(folder).sha256).cases:
        if case.method == "poor" and case.kind in ("single", "pair", "triple") and folder.outcome(case.id):
            found = unsealed(folder, case, case.id)
            if found.failure is None and _proposed(folder, case.id) is not None:
                yield case, found


def second_answer(folder: TrialFolder, case: TrueCase) -> tuple[str, ...] | None:
    """What is named from both recordings, sorted; None while the stroke has not been made."""
    path = _answer(folder, case.id)
    if not path.exists():
        return None
    return tuple(sorted(effect["name"] for effect in orjson.loads(path.read_bytes())["effects"]))


def make(folder: TrialFolder, case: TrueCase) -> None:
    """Record the proposed stroke of a case, and diagnose it together with the first recording."""
    answer, log = _answer(folder, case.id), folder.root / "next" / f"{case.id}.mcap"
    if answer.exists():
        return
    answer.parent.mkdir(exist_ok=True)
    files, method = folder.files(case.id), answer.with_suffix(".method.json")
    known = orjson.loads(folder.method(f"{case.method}_{case.damper}_{case.variant}").read_bytes())
    stroke = {**known, "name": "next", "segments": [_proposed(folder, case.id)]}
    folder.put(method, orjson.dumps(stroke).decode())
    partial = answer.with_suffix(".partial.json")
    if not log.exists():
        half = log.with_suffix(".partial.mcap")
        half.unlink(missing_ok=True)
        seed = str(case.seed + SEED)
        call([*MRBENCH, "run", method, "--scenario", files.scenario, "--seed", seed, "--out", half])
        half.replace(log)
    call([*DIAGNOSE, files.log, log, "--out", partial])
    partial.replace(answer)


def _answer(folder: TrialFolder, case: str) -> Path:
    return folder.root / "next" / f"{case}.json"


def _proposed(folder: TrialFolder, case: str) -> dict[str, Any] | None:
    """The segment that a diagnosis asks for."""
    proposed = orjson.loads(folder.files(case).diagnosis.read_bytes())["next_stroke"]
    return None if proposed is None else dict(proposed["segment"])


def main() -> None:
    """Make the strokes that the diagnoses of a trial asked for."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("trial", type=Path, help="the answer of `mrbench trial`; its folder stands beside it")
    folder = TrialFolder(options.parse_args().trial)
    for case, before in open_cases(folder):
        try:
            make(folder, case)
        except CommandFailedError as error:
            print(f"{case.id}: {error}")
            continue
        named = before.named.effects if before.named else ()
        print(f"{case.id}: {before.truth}, named {named}, then {second_answer(folder, case)}", flush=True)


if __name__ == "__main__":
    main()

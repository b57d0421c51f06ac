"""The course of a trial: draw, seal and publish, record, diagnose; each step only where its file is missing."""

import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor, as_completed
from importlib.metadata import version
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple, TypeVar, get_args

import orjson
from pydantic import ValidationError

from sim_rig.errors import TrialError
from sim_rig.trial.draw import Drawn, draw, draw_grid, settle
from sim_rig.trial.folder import Draw, Outcome, Seal, TrialFolder
from sim_rig.trial.processes import MRBENCH, CommandFailedError, call
from sim_rig.trial.specimens import SIZES
from sim_rig.trial.strokes import VARIANTS, Kind, method_document, strokes
from sim_rig.trial.truth import TrueCase, Truth, read_sealed, write_sealed
from sim_rig.trial.wires import record_over_wires

DIAGNOSE = (*MRBENCH, "diagnose")
"""The command that diagnoses: LOG --out FILE --twin FILE follow."""
WIRES = "_wires"
"""Ends the name of a case that is recorded once more over wires."""
UNSEEN_SEED = 7919
"""Added to a case's seed for the run that its diagnosis never sees."""
Progress = Callable[[str, float], None]
Result = TypeVar("Result")


class Plan(NamedTuple):
    """What is asked of a trial."""

    cases: int
    seed: int
    draw: Draw = "blind"
    workers: int = 1
    over_wires: int = 0
    diagnose: Sequence[str] = DIAGNOSE


def sealed_truth(folder: TrialFolder, plan: Plan, progress: Progress) -> tuple[Seal, Truth]:
    """The truth of a trial: the one sealed before, or a new one, sealed and published now.

    Raises:
        TrialError: the folder holds another trial, or its seal is broken.
    """
    seal = folder.seal()
    if seal is None:
        folder.prepare()
        drawn = (draw if plan.draw == "blind" else draw_grid)(plan.cases, plan.seed)
        truth = Truth(cases=tuple(_settled(folder, drawn, plan, progress)))
        digest = write_sealed(folder.truth, truth)
        seal = Seal(cases=plan.cases, seed=plan.seed, draw=plan.draw, version=version("mrbench"), sha256=digest)
        folder.publish(seal)
    if (seal.cases, seal.seed, seal.draw) != (plan.cases, plan.seed, plan.draw):
        raise TrialError(
            f"{folder.root} holds a trial of {seal.cases} cases with seed {seal.seed} ({seal.draw}); "
            "take the same, or another --out"
        )
    return seal, read_sealed(folder.truth, seal.sha256)


def run_cases(folder: TrialFolder, truth: Truth, plan: Plan, progress: Progress) -> None:
    """Record and diagnose all cases, several at a time; what is there already is left alone.

    Raises:
        TrialError: a case cannot be recorded. A diagnosis without an answer is an outcome, not an error.
    """
    _write_methods(folder, plan.seed)
    todo = [(case, case.id) for case in truth.cases]
    todo += [(case, case.id + WIRES) for case in truth.cases[: plan.over_wires]]
    with ThreadPoolExecutor(plan.workers) as pool:
        waiting = [pool.submit(_run_case, folder, case, name, plan.diagnose) for case, name in todo]
        _collect(pool, waiting, lambda share: progress("record and diagnose", share))


def _run_case(folder: TrialFolder, case: TrueCase, name: str, diagnose: Sequence[str]) -> None:
    """Record and diagnose a case, unless that is done, or another process of this trial is about it."""
    with folder.claim(name) as mine:
        done = folder.outcome(name)
        if mine and (done is None or done.failure is not None or not folder.files(name).diagnosis.exists()):
            _record_and_diagnose(folder, case, name, diagnose)


def _record_and_diagnose(folder: TrialFolder, case: TrueCase, name: str, diagnose: Sequence[str]) -> None:
    files = folder.files(name)
    folder.put(files.scenario, orjson.dumps(case.scenario).decode())
    _record(folder, case, files.scenario, files.log, over_wires=name.endswith(WIRES))
    started = time.monotonic()
    failure = _diagnosed(files.log, files.diagnosis, files.twin, diagnose)
    seconds = round(time.monotonic() - started, 3)
    if failure is None and case.effects and files.twin.exists() and not name.endswith(WIRES):
        _predict(folder, case, name)
    folder.put(files.outcome, Outcome(seconds=seconds, failure=failure).model_dump_json() + "\n")


def _record(folder: TrialFolder, case: TrueCase, scenario: Path, log: Path, *, over_wires: bool) -> None:
    if log.exists():
        return
    method, partial = (
        folder.method(f"{case.method}_{case.damper}_{case.variant}"),
        log.with_suffix(".partial.mcap"),
    )
    partial.unlink(missing_ok=True)
    if over_wires:
        record_over_wires(method, scenario, partial)
    else:
        _record_from_plant(method, scenario, case.seed, partial)
    partial.replace(log)


def _record_from_plant(method: Path, scenario: Path, seed: int, log: Path) -> None:
    call([*MRBENCH, "run", method, "--scenario", scenario, "--seed", str(seed), "--out", log])


def _diagnosed(log: Path, diagnosis: Path, twin: Path, diagnose: Sequence[str]) -> str | None:
    """Diagnose a log; what went wrong, if anything did."""
    partial = diagnosis.with_suffix(".partial.json")
    try:
        call([*diagnose, log, "--out", partial, "--twin", twin])
        partial.replace(diagnosis)
    except CommandFailedError as error:
        return str(error)
    except OSError as error:
        return f"no diagnosis was left: {error.strerror}"
    return None


def _predict(folder: TrialFolder, case: TrueCase, name: str) -> None:
    """Let the twin predict a run that the diagnosis never saw; without an answer there is no true shrinkage."""
    files = folder.files(name)
    if not files.unseen.exists():
        partial = files.unseen.with_suffix(".partial.mcap")
        partial.unlink(missing_ok=True)
        method = folder.method(f"unseen_{case.method}_{case.damper}_{case.variant}")
        _record_from_plant(method, files.scenario, case.seed + UNSEEN_SEED, partial)
        partial.replace(files.unseen)
    try:
        # The load cell has another zero in every run: that is nothing that a diagnosis can know.
        call([*MRBENCH, "predict", files.twin, files.unseen, "--free", "offset", "--out", files.prediction])
    except CommandFailedError as error:
        files.prediction.with_suffix(".failure.txt").write_text(f"{error}\n", encoding="utf-8")


def _write_methods(folder: TrialFolder, seed: int) -> None:
    for size in SIZES:
        for kind in get_args(Kind):
            for variant in range(VARIANTS):
                name = f"{kind}_{size}_{variant}"
                document = method_document(name, size, strokes(kind, size, seed, variant))
                folder.put(folder.method(name), orjson.dumps(document, option=orjson.OPT_INDENT_2).decode())


def _settled(folder: TrialFolder, drawn: Sequence[Drawn], plan: Plan, progress: Progress) -> Iterable[TrueCase]:
    """The cases with their sizes; those of one bench in one process, which keeps its slopes."""
    benches: dict[tuple[str, str, int], list[Drawn]] = {}
    for one in drawn:
        benches.setdefault((one.damper, one.method, one.variant), []).append(one)
    kept, found = folder.root / "sealed", list[TrueCase]()
    with ProcessPoolExecutor(plan.workers, get_context("spawn")) as pool:
        waiting = [pool.submit(_settle_some, some, plan.seed, kept) for some in benches.values()]
        for cases in _collect(pool, waiting, lambda share: progress("draw", share)):
            found += cases
    return sorted(found, key=lambda case: case.id)


def _settle_some(drawn: Sequence[Drawn], seed: int, kept: Path) -> list[TrueCase]:
    """Settle the cases of one bench; each is kept at once, so that a killed draw goes on."""
    return [_kept(one, seed, kept / f"case_{one.number:03d}.truth.json") for one in drawn]


def _kept(drawn: Drawn, seed: int, path: Path) -> TrueCase:
    try:
        return TrueCase.model_validate_json(path.read_bytes())
    except (OSError, ValidationError):
        case = settle(drawn, seed)
        path.write_text(case.model_dump_json(), encoding="utf-8")
        return case


def _collect(
    pool: Executor, waiting: "Sequence[Future[Result]]", progress: Callable[[float], None]
) -> list[Result]:
    """The results of all, as they come; the first error ends what has not begun."""
    results = []
    try:
        for done, future in enumerate(as_completed(waiting), 1):
            results.append(future.result())
            progress(done / len(waiting))
    except BaseException:
        pool.shutdown(cancel_futures=True)
        raise
    return results

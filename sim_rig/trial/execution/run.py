"""Steps of a trial: draw, seal and publish, record, diagnose; a step whose file exists is skipped."""

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
from sim_rig.trial.cases import (
    SIZES,
    VARIANTS,
    DiagnosisOutcome,
    RunKind,
    SampledCase,
    Seal,
    SealedTruth,
    TrialFolder,
    TrialKind,
    TrueCase,
    draw_cases,
    draw_grid,
    make_method_document,
    make_strokes,
    read_sealed_truth,
    size_case,
    write_sealed_truth,
)
from sim_rig.trial.execution.processes import MRBENCH, CommandFailedError, run_command
from sim_rig.trial.execution.wires import record_over_wires

DIAGNOSE = (*MRBENCH, "diagnose")
"""Command that diagnoses; LOG --out FILE --twin FILE are appended."""
WIRES_SUFFIX = "_wires"
"""Suffix of the name of a case that is recorded again over wires."""
VALIDATION_SEED_OFFSET = 7919
"""Offset of the seed of a validation run from that of its case."""
Progress = Callable[[str, float], None]
Result = TypeVar("Result")


class TrialOptions(NamedTuple):
    """Size, seed and workers of a trial."""

    cases: int
    seed: int
    kind: TrialKind = "blind"
    workers: int = 1
    wired: int = 0
    diagnose: Sequence[str] = DIAGNOSE


def prepare_truth(folder: TrialFolder, options: TrialOptions, progress: Progress) -> tuple[Seal, SealedTruth]:
    """Return the truth of a trial: the one sealed before, or a new one that is sealed and published.

    Raises:
        TrialError: the folder contains another trial, or its seal is broken.
    """
    seal = folder.read_seal()
    if seal is None:
        seal = _seal_new_truth(folder, options, progress)
    if (seal.cases, seal.seed, seal.kind) != (options.cases, options.seed, options.kind):
        raise TrialError(
            f"{folder.root} contains a trial of {seal.cases} cases with seed {seal.seed} ({seal.kind}); "
            "use the same options, or another --out"
        )
    return seal, read_sealed_truth(folder.truth, seal.sha256)


def _seal_new_truth(folder: TrialFolder, options: TrialOptions, progress: Progress) -> Seal:
    folder.prepare()
    sampled = (draw_cases if options.kind == "blind" else draw_grid)(options.cases, options.seed)
    truth = SealedTruth(cases=tuple(_size_cases(folder, sampled, options, progress)))
    digest = write_sealed_truth(folder.truth, truth)
    seal = Seal(
        cases=options.cases, seed=options.seed, kind=options.kind, version=version("mrbench"), sha256=digest
    )
    # Published before anything is recorded, so that the truth cannot be changed after the diagnoses are known.
    folder.publish_seal(seal)
    return seal


def run_cases(folder: TrialFolder, truth: SealedTruth, options: TrialOptions, progress: Progress) -> None:
    """Record and diagnose all cases, several in parallel; finished cases are skipped.

    Raises:
        TrialError: a case cannot be recorded. A failed diagnosis is an outcome and not an error.
    """
    _write_methods(folder, options.seed)
    pending = [(case, case.id) for case in truth.cases]
    pending += [(case, case.id + WIRES_SUFFIX) for case in truth.cases[: options.wired]]
    with ThreadPoolExecutor(options.workers) as pool:
        futures = [pool.submit(_run_case, folder, case, name, options.diagnose) for case, name in pending]
        _collect(pool, futures, lambda fraction: progress("record and diagnose", fraction))


def _run_case(folder: TrialFolder, case: TrueCase, name: str, diagnose: Sequence[str]) -> None:
    """Record and diagnose a case, unless it is finished or another process of this trial works on it."""
    with folder.claim(name) as claimed:
        outcome = folder.read_outcome(name)
        finished = outcome is not None and outcome.failure is None
        if claimed and not (finished and folder.get_case_files(name).diagnosis.exists()):
            _record_and_diagnose(folder, case, name, diagnose)


def _record_and_diagnose(folder: TrialFolder, case: TrueCase, name: str, diagnose: Sequence[str]) -> None:
    files = folder.get_case_files(name)
    folder.write_file(files.scenario, orjson.dumps(case.scenario).decode())
    _record(folder, case, files.scenario, files.log, wired=name.endswith(WIRES_SUFFIX))
    started = time.monotonic()
    failure = _diagnose(files.log, files.diagnosis, files.twin, diagnose)
    seconds = round(time.monotonic() - started, 3)
    if failure is None and case.effects and files.twin.exists() and not name.endswith(WIRES_SUFFIX):
        _predict(folder, case, name)
    folder.write_file(files.outcome, DiagnosisOutcome(seconds=seconds, failure=failure).model_dump_json() + "\n")


def _record(folder: TrialFolder, case: TrueCase, scenario: Path, log: Path, *, wired: bool) -> None:
    if log.exists():
        return
    method = folder.get_method_path(f"{case.method}_{case.damper}_{case.variant}")
    partial = log.with_suffix(".partial.mcap")
    partial.unlink(missing_ok=True)
    if wired:
        record_over_wires(method, scenario, partial)
    else:
        _record_from_plant(method, scenario, case.seed, partial)
    partial.replace(log)


def _record_from_plant(method: Path, scenario: Path, seed: int, log: Path) -> None:
    run_command([*MRBENCH, "run", method, "--scenario", scenario, "--seed", str(seed), "--out", log])


def _diagnose(log: Path, diagnosis: Path, twin: Path, diagnose: Sequence[str]) -> str | None:
    """Diagnose a log; return the error message if it fails."""
    partial = diagnosis.with_suffix(".partial.json")
    try:
        run_command([*diagnose, log, "--out", partial, "--twin", twin])
        partial.replace(diagnosis)
    except CommandFailedError as error:
        return str(error)
    except OSError as error:
        return f"the diagnosis wrote no file: {error.strerror}"
    return None


def _predict(folder: TrialFolder, case: TrueCase, name: str) -> None:
    """Predict a validation run with the twin; if this fails, the case has no true shrinkage."""
    files = folder.get_case_files(name)
    if not files.validation_log.exists():
        partial = files.validation_log.with_suffix(".partial.mcap")
        partial.unlink(missing_ok=True)
        method = folder.get_method_path(f"validation_{case.method}_{case.damper}_{case.variant}")
        _record_from_plant(method, files.scenario, case.seed + VALIDATION_SEED_OFFSET, partial)
        partial.replace(files.validation_log)
    try:
        # The offset is free, as the zero of the load cell differs from run to run.
        run_command(
            [*MRBENCH, "predict", files.twin, files.validation_log, "--free", "offset", "--out", files.prediction]
        )
    except CommandFailedError as error:
        files.prediction.with_suffix(".failure.txt").write_text(f"{error}\n", encoding="utf-8")


def _write_methods(folder: TrialFolder, seed: int) -> None:
    for size in SIZES:
        for kind in get_args(RunKind):
            for variant in range(VARIANTS):
                name = f"{kind}_{size}_{variant}"
                document = make_method_document(name, size, make_strokes(kind, size, seed, variant))
                folder.write_file(
                    folder.get_method_path(name), orjson.dumps(document, option=orjson.OPT_INDENT_2).decode()
                )


def _size_cases(
    folder: TrialFolder, sampled: Sequence[SampledCase], options: TrialOptions, progress: Progress
) -> Iterable[TrueCase]:
    """Choose the sizes of all cases; those of one sizing model in one process, which reuses its sensitivities."""
    groups: dict[tuple[str, str, int], list[SampledCase]] = {}
    for case in sampled:
        groups.setdefault((case.damper, case.method, case.variant), []).append(case)
    store, sized = folder.root / "sealed", list[TrueCase]()
    with ProcessPoolExecutor(options.workers, get_context("spawn")) as pool:
        futures = [pool.submit(_size_group, group, options.seed, store) for group in groups.values()]
        for cases in _collect(pool, futures, lambda fraction: progress("draw", fraction)):
            sized += cases
    return sorted(sized, key=lambda case: case.id)


def _size_group(sampled: Sequence[SampledCase], seed: int, store: Path) -> list[TrueCase]:
    """Choose the sizes of a group of cases; each case is stored at once, so that a killed draw continues."""
    return [_load_or_size(case, seed, store / f"case_{case.number:03d}.truth.json") for case in sampled]


def _load_or_size(sampled: SampledCase, seed: int, path: Path) -> TrueCase:
    try:
        return TrueCase.model_validate_json(path.read_bytes())
    except (OSError, ValidationError):
        case = size_case(sampled, seed)
        path.write_text(case.model_dump_json(), encoding="utf-8")
        return case


def _collect(
    pool: Executor, futures: "Sequence[Future[Result]]", progress: Callable[[float], None]
) -> list[Result]:
    """Return the results in the order of completion; the first error cancels what has not started."""
    results = []
    try:
        for done, future in enumerate(as_completed(futures), 1):
            results.append(future.result())
            progress(done / len(futures))
    except BaseException:
        pool.shutdown(cancel_futures=True)
        raise
    return results

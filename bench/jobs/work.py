"""Execution of a job: runs its commands as processes, with progress, time limit and cancellation."""

import contextlib
import os
import queue
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import mkdtemp

from bench.errors import LogError
from bench.jobs.errors import JobCancelledError, JobError
from bench.jobs.job_spec import (
    DIAGNOSIS_FILE,
    FIT_FILE,
    PREDICTION_FILE,
    REPORT_FILE,
    SERIES_FILE,
    TREND_FILE,
    TWIN_FILE,
    JobSpec,
    ResultSummary,
)
from bench.jobs.progress import PROGRESS_ENVIRONMENT, CommandStep, JobProgress, is_report
from bench.jobs.settings import DiagnoseSettings, PredictSettings, TrendSettings
from bench.jobs.summaries import (
    read_diagnosis_summary,
    read_fit_summary,
    read_prediction_summary,
    read_trend_summary,
)
from bench.processes import MRBENCH_COMMAND, LineQueue, start_line_reader
from bench.samples import SampleStore

POLL_PERIOD = 0.25
"""Time [s] between two checks for cancellation."""
SINGLE_THREAD_ENVIRONMENT = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Environment that keeps a job on one core, so that the rig agent has the others."""
WATCHDOG_COMMAND = (sys.executable, "-P", str(Path(__file__).with_name("parent_watchdog.py")))
"""Command that ends a job's processes when the worker ends; as a file, because the package would import dask."""
_ANALYSIS_SHARE = 0.95
"""Completed share of a job when only its report is missing."""


@dataclass(frozen=True)
class JobCallbacks:
    """Functions by which a job reports progress and asks whether it was cancelled."""

    on_progress: Callable[[JobProgress], None]
    is_cancelled: Callable[[], bool]


def execute_job(
    spec: JobSpec, callbacks: JobCallbacks, mrbench: tuple[str, ...] = MRBENCH_COMMAND
) -> ResultSummary:
    """Identify, diagnose or predict a log, or find a trend; the files appear together, or not at all.

    Args:
        spec: the job; if its result exists, it is only read.
        callbacks: progress and cancellation.
        mrbench: the command line to call.

    Returns:
        Summary of the fit, the diagnosis, the prediction or the trend.

    Raises:
        JobError: a command failed, or the time limit was reached.
        JobCancelledError: the job was cancelled.
    """
    log, result = Path(spec.log), Path(spec.result)
    missing = next((path for path in (log, *map(Path, spec.logs)) if not path.is_file()), None)
    if missing is not None:
        raise JobError(f"{missing} is not on the worker's machine; workers need the data folder at the same path")
    deadline = time.monotonic() + spec.settings.time_limit_s
    _store_samples(log, spec.log_sha256)
    if not result.is_dir():
        with _make_work_folder(result) as folder:
            for step, arguments in _list_commands(spec, folder):
                _run_command([*mrbench, *arguments], step, callbacks, deadline)
            _publish_result(folder, result)
    if isinstance(spec.settings, TrendSettings):
        return read_trend_summary(result / TREND_FILE)
    if isinstance(spec.settings, DiagnoseSettings):
        return read_diagnosis_summary(result / DIAGNOSIS_FILE)
    if isinstance(spec.settings, PredictSettings):
        return read_prediction_summary(result / PREDICTION_FILE)
    return read_fit_summary(result / FIT_FILE)


def _store_samples(log: Path, sha256: str) -> None:
    """Store the samples as columns, so that the service need not read the log when a person looks at the run."""
    with contextlib.suppress(LogError):  # the command of the job says what is wrong with the log
        if sha256:
            SampleStore(log.parent).load(log, sha256)


def _list_commands(spec: JobSpec, folder: Path) -> list[tuple[CommandStep, list[str]]]:
    """Return the arguments of the commands of a job, which write to a folder."""
    if isinstance(spec.settings, PredictSettings):
        return [(CommandStep("predict", 0.0, 1.0), _make_prediction_command(spec, folder))]
    fit, diagnosis = folder / FIT_FILE, folder / DIAGNOSIS_FILE
    options = spec.settings.make_cli_arguments()
    if isinstance(spec.settings, TrendSettings):
        return [(CommandStep("trend", 0.0, 1.0), ["trend", *spec.logs, "--out", str(folder / TREND_FILE)])]
    if isinstance(spec.settings, DiagnoseSettings):
        name = "diagnose"
        options += ["--model", spec.model] if spec.model else []
        analyse = [name, spec.log, "--out", str(diagnosis), "--twin", str(folder / TWIN_FILE), *options]
        documents = [*(["--fit", spec.fit] if spec.fit else []), "--diagnosis", str(diagnosis)]
    else:
        name = "identify"
        analyse = [name, spec.log, "--out", str(fit), *options]
        documents = ["--fit", str(fit), "--series", str(folder / SERIES_FILE)]
    report = ["report", spec.log, *documents, "--out", str(folder / REPORT_FILE)]
    return [
        (CommandStep(name, 0.0, _ANALYSIS_SHARE), analyse),
        (CommandStep("report", _ANALYSIS_SHARE, 1.0), report),
    ]


def _make_prediction_command(spec: JobSpec, folder: Path) -> list[str]:
    outputs = ["--out", str(folder / PREDICTION_FILE), "--series", str(folder / SERIES_FILE)]
    return ["predict", spec.model, spec.log, *outputs, *spec.settings.make_cli_arguments()]


@contextlib.contextmanager
def _make_work_folder(result: Path) -> Iterator[Path]:
    """Provide an empty folder next to the result, after deleting those of killed attempts."""
    remove_work_folders(result)
    try:
        folder = Path(mkdtemp(prefix=_make_prefix(result), dir=result.parent))
    except OSError as error:
        raise JobError(f"{result.parent} cannot be written to: {error.strerror}") from None
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def remove_work_folders(result: Path) -> None:
    """Delete the work folders of killed attempts at a result."""
    for leftover in result.parent.glob(f"{_make_prefix(result)}*"):
        shutil.rmtree(leftover, ignore_errors=True)


def _make_prefix(result: Path) -> str:
    return f".{result.name}."


def _publish_result(folder: Path, result: Path) -> None:
    """Rename the work folder to the result folder; another attempt may already have created an equal one."""
    folder.chmod(0o755)  # mkdtemp makes it private, the rest of the data folder is readable
    try:
        folder.rename(result)
    except OSError as error:
        if not result.is_dir():
            raise JobError(f"{result} cannot be written: {error.strerror}") from None


def _run_command(command: list[str], step: CommandStep, callbacks: JobCallbacks, deadline: float) -> None:
    """Run one command; its last output line is the reason of a failure."""
    callbacks.on_progress(step.begin())
    process = subprocess.Popen(
        [*WATCHDOG_COMMAND, *command],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        env=os.environ | SINGLE_THREAD_ENVIRONMENT | PROGRESS_ENVIRONMENT,
    )
    lines, reader = start_line_reader(process)
    try:
        last = _follow_output(lines, step, callbacks, deadline)
    finally:
        # When its input ends, the watchdog kills the command if it is still running.
        if process.stdin is not None:
            process.stdin.close()
        process.wait()
        reader.join()
        if process.stderr is not None:
            process.stderr.close()
    if process.returncode != 0:
        raise JobError(f"{step.name}: {last.removeprefix('mrbench: ') or f'exit status {process.returncode}'}")


def _follow_output(lines: LineQueue, step: CommandStep, callbacks: JobCallbacks, deadline: float) -> str:
    """Report the output of a command until it ends, and return its last line that is not a report of progress."""
    last, latest = "", step.begin()
    while True:
        if callbacks.is_cancelled():
            raise JobCancelledError("cancelled")
        if time.monotonic() > deadline:
            raise JobError(f"{step.name}: stopped at its time limit; give the job a larger time_limit_s")
        try:
            line = lines.get(timeout=POLL_PERIOD)
        except queue.Empty:
            continue
        if line is None:
            return last
        if text := line.strip():
            last = last if is_report(text) else text
            latest = step.read_line(text, latest)
            callbacks.on_progress(latest)

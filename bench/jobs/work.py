"""Execution of a job: runs `mrbench identify` and `mrbench report`, with progress, time limit and cancellation."""

import contextlib
import json
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

from bench.errors import BenchError
from bench.jobs.errors import JobCancelledError, JobError
from bench.jobs.job_spec import FIT_FILE, REPORT_FILE, FitSummary, JobSpec
from bench.processes import MRBENCH_COMMAND, LineQueue, start_line_reader
from bench.report import read_fit

POLL_PERIOD = 0.25
"""Time [s] between two checks for cancellation."""
SINGLE_THREAD_ENVIRONMENT = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Environment that keeps a job on one core, so that the rig agent has the others."""
WATCHDOG_COMMAND = (sys.executable, "-m", "bench.jobs.parent_watchdog")
"""Command that ends a job's processes when the worker ends."""


@dataclass(frozen=True)
class JobCallbacks:
    """Functions by which a job reports progress and asks whether it was cancelled."""

    on_progress: Callable[[str], None]
    is_cancelled: Callable[[], bool]


def execute_job(spec: JobSpec, callbacks: JobCallbacks, mrbench: tuple[str, ...] = MRBENCH_COMMAND) -> FitSummary:
    """Identify a log and write a report; the files of both appear together, or not at all.

    Args:
        spec: the job; if its result exists, it is only read.
        callbacks: progress and cancellation.
        mrbench: the command line to call.

    Returns:
        Summary of the fit.

    Raises:
        JobError: a command failed, or the time limit was reached.
        JobCancelledError: the job was cancelled.
    """
    log, result = Path(spec.log), Path(spec.result)
    if not log.is_file():
        raise JobError(f"{log} is not on the worker's machine; workers need the data folder at the same path")
    deadline = time.monotonic() + spec.settings.time_limit_s
    if not result.is_dir():
        with _make_work_folder(result) as folder:
            fit, report = folder / FIT_FILE, folder / REPORT_FILE
            identify = ["identify", str(log), "--out", str(fit), *spec.settings.make_cli_arguments()]
            _run_command([*mrbench, *identify], "identify", callbacks, deadline)
            page = ["report", str(log), "--fit", str(fit), "--out", str(report)]
            _run_command([*mrbench, *page], "report", callbacks, deadline)
            _publish_result(folder, result)
    return read_fit_summary(result / FIT_FILE)


def read_fit_summary(path: Path) -> FitSummary:
    """Read the summary of a fit.

    Raises:
        JobError: the file is not a fit.
    """
    try:
        fit = read_fit(path)
        document = json.loads(path.read_text("utf-8"))
    except (BenchError, OSError, ValueError) as error:
        raise JobError(f"{path} cannot be read: {error}") from None
    return {
        "result": document.get("result", ""),
        "rmse_n": fit.rmse_n.train,
        "held_out_rmse_n": fit.rmse_n.held_out,
        "noise_floor_n": fit.noise_floor_n,
    }


@contextlib.contextmanager
def _make_work_folder(result: Path) -> Iterator[Path]:
    """Provide an empty folder next to the result, after deleting those of killed attempts."""
    prefix = f".{result.name}."
    for leftover in result.parent.glob(f"{prefix}*"):
        shutil.rmtree(leftover, ignore_errors=True)
    try:
        folder = Path(mkdtemp(prefix=prefix, dir=result.parent))
    except OSError as error:
        raise JobError(f"{result.parent} cannot be written to: {error.strerror}") from None
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _publish_result(folder: Path, result: Path) -> None:
    """Rename the work folder to the result folder; another attempt may already have created an equal one."""
    folder.chmod(0o755)  # mkdtemp makes it private, the rest of the data folder is readable
    try:
        folder.rename(result)
    except OSError as error:
        if not result.is_dir():
            raise JobError(f"{result} cannot be written: {error.strerror}") from None


def _run_command(command: list[str], name: str, callbacks: JobCallbacks, deadline: float) -> None:
    """Run one command; its last output line is the reason of a failure."""
    callbacks.on_progress(name)
    process = subprocess.Popen(
        [*WATCHDOG_COMMAND, *command],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        env=os.environ | SINGLE_THREAD_ENVIRONMENT,
    )
    lines, reader = start_line_reader(process)
    try:
        last = _follow_output(lines, name, callbacks, deadline)
    finally:
        # When its input ends, the watchdog kills the command if it is still running.
        if process.stdin is not None:
            process.stdin.close()
        process.wait()
        reader.join()
        if process.stderr is not None:
            process.stderr.close()
    if process.returncode != 0:
        raise JobError(f"{name}: {last.removeprefix('mrbench: ') or f'exit status {process.returncode}'}")


def _follow_output(lines: LineQueue, name: str, callbacks: JobCallbacks, deadline: float) -> str:
    """Report the output of a command until it ends, and return its last line."""
    last = ""
    while True:
        if callbacks.is_cancelled():
            raise JobCancelledError("cancelled")
        if time.monotonic() > deadline:
            raise JobError(f"{name}: stopped at its time limit; give the job a larger time_limit_s")
        try:
            line = lines.get(timeout=POLL_PERIOD)
        except queue.Empty:
            continue
        if line is None:
            return last
        if line.strip():
            last = line.strip()
            callbacks.on_progress(f"{name}: {last}")

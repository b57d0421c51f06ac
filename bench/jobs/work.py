"""What a worker does for an order: the commands that a person would type, followed, timed and stoppable."""

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

from bench.child_process import MRBENCH, Lines, read_along
from bench.errors import BenchError
from bench.jobs.errors import JobCancelledError, JobError
from bench.jobs.order import FIT, REPORT, Order, Summary
from bench.report.documents import read_fit

LOOK_EVERY = 0.25
"""[s] between two looks whether somebody wants the end."""
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""A job keeps to one core; the other belongs to the rig."""
LEASH = (sys.executable, "-m", "bench.jobs.leash")


@dataclass(frozen=True)
class Following:
    """Who is told, and who may end it."""

    says: Callable[[str], None]
    """Told what is being done."""
    cancelled: Callable[[], bool]
    """Asked a few times a second."""


def carry_out(order: Order, following: Following, mrbench: tuple[str, ...] = MRBENCH) -> Summary:
    """Identify a log and report on it; both files appear together, or not at all.

    Args:
        order: what to do; work that is done already is not done again.
        following: who is told, and who may end it.
        mrbench: the command line to call.

    Returns:
        The fit in short.

    Raises:
        JobError: a command could not do its work, or the time is up.
        JobCancelledError: somebody wanted the end.
    """
    log, result = Path(order.log), Path(order.result)
    if not log.is_file():
        raise JobError(f"{log} is not on the worker's machine; workers need the data folder at the same place")
    deadline = time.monotonic() + order.settings.time_limit_s
    if not result.is_dir():
        with _workplace(result) as place:
            fit, report = place / FIT, place / REPORT
            identify = ["identify", str(log), "--out", str(fit), *order.settings.words()]
            _run([*mrbench, *identify], "identify", following, deadline)
            page = ["report", str(log), "--fit", str(fit), "--out", str(report)]
            _run([*mrbench, *page], "report", following, deadline)
            _appear(place, result)
    return summary_of(result / FIT)


def summary_of(fit: Path) -> Summary:
    """What a catalogue keeps of a fit.

    Raises:
        JobError: it is no fit.
    """
    try:
        found = read_fit(fit)
        said = json.loads(fit.read_text("utf-8"))
    except (BenchError, OSError, ValueError) as error:
        raise JobError(f"{fit} cannot be read: {error}") from None
    return {
        "result": said.get("result", ""),
        "rmse_n": found.rmse_n.train,
        "held_out_rmse_n": found.rmse_n.held_out,
        "noise_floor_n": found.noise_floor_n,
    }


@contextlib.contextmanager
def _workplace(result: Path) -> Iterator[Path]:
    """An empty folder beside the result; what an attempt that was killed has left there goes first."""
    before = f".{result.name}."
    for left in result.parent.glob(f"{before}*"):
        shutil.rmtree(left, ignore_errors=True)
    try:
        place = Path(mkdtemp(prefix=before, dir=result.parent))
    except OSError as error:
        raise JobError(f"{result.parent} cannot be written to: {error.strerror}") from None
    try:
        yield place
    finally:
        shutil.rmtree(place, ignore_errors=True)


def _appear(place: Path, result: Path) -> None:
    """Give the folder its name; another attempt may have been first, with the same content."""
    place.chmod(0o755)  # mkdtemp keeps it from others, who may read all else in the data folder
    try:
        place.rename(result)
    except OSError as error:
        if not result.is_dir():
            raise JobError(f"{result} cannot be written: {error.strerror}") from None


def _run(command: list[str], what: str, following: Following, deadline: float) -> None:
    """Run one command to its end; its last line is its complaint."""
    following.says(what)
    process = subprocess.Popen(
        [*LEASH, *command],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        env=os.environ | ONE_THREAD,
    )
    lines, reader = read_along(process)
    try:
        last = _follow(lines, what, following, deadline)
    finally:
        # With the end of its input the leash ends the command, if that still runs.
        if process.stdin is not None:
            process.stdin.close()
        process.wait()
        reader.join()
        if process.stderr is not None:
            process.stderr.close()
    if process.returncode != 0:
        raise JobError(f"{what}: {last.removeprefix('mrbench: ') or f'exit status {process.returncode}'}")


def _follow(lines: Lines, what: str, following: Following, deadline: float) -> str:
    """The last line that was said, once all is said."""
    last = ""
    while True:
        if following.cancelled():
            raise JobCancelledError("cancelled")
        if time.monotonic() > deadline:
            raise JobError(f"{what}: stopped, its time limit was reached; give the job a larger time_limit_s")
        try:
            line = lines.get(timeout=LOOK_EVERY)
        except queue.Empty:
            continue
        if line is None:
            return last
        if line.strip():
            last = line.strip()
            following.says(f"{what}: {last}")

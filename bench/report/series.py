"""The force that a fit predicts for a log, got from ``mrbench predict`` as a process."""

import subprocess
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from zipfile import BadZipFile

import numpy as np
import numpy.typing as npt

from bench.child_process import MRBENCH
from bench.errors import ReportError
from bench.report.documents import Prediction, read_prediction

NAMES = ("time", "displacement", "velocity", "drive", "force", "simulated", "stretch", "held_out")
LONGEST = 1800.0
"""[s] after which a prediction is given up."""


@dataclass(frozen=True)
class Series:
    """Recorded and simulated force of a log."""

    arrays: dict[str, npt.NDArray[np.generic]]
    """By name, each (N,): time [s], displacement [m], velocity [m/s], drive [V or A], force and simulated [N],
    number of the stretch, and whether the fit did not see the sample."""


def predict(fit: Path, log: Path) -> tuple[Prediction, Series]:
    """Simulate a fit on a log.

    Raises:
        ReportError: the prediction fails; its own line says why.
    """
    with TemporaryDirectory(prefix="mrbench-report-") as folder:
        answer, series = Path(folder, "prediction.json"), Path(folder, "series.npz")
        command = [*MRBENCH, "predict", str(fit), str(log)]
        done = _call([*command, "--out", str(answer), "--series", str(series)])
        if done.returncode != 0:
            said = done.stderr.strip().splitlines() or [f"exit status {done.returncode}"]
            raise ReportError(f"the fit cannot be simulated on {log}: {said[-1].removeprefix('mrbench: ')}")
        return read_prediction(answer), read_series(series)


def read_series(path: Path) -> Series:
    """A series from its .npz file.

    Raises:
        ReportError: it cannot be read, or its arrays are not those of a series.
    """
    try:
        with np.load(path) as file:
            arrays = {name: file[name] for name in NAMES}
    except (OSError, KeyError, ValueError, BadZipFile) as error:
        raise ReportError(f"{path}: not a series of `mrbench predict` ({error})") from error
    if len(lengths := {array.shape for array in arrays.values()}) > 1:
        raise ReportError(f"{path}: the arrays of the series differ in length ({sorted(lengths)})")
    return Series(arrays)


def _call(command: list[str]) -> subprocess.CompletedProcess[str]:
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=LONGEST, check=False)
    except subprocess.TimeoutExpired as error:
        raise ReportError(f"the prediction was given up after {LONGEST:g} s; give a shorter log") from error

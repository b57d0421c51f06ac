"""Force that a fit predicts for a log, computed by ``mrbench predict`` as a process."""

import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from zipfile import BadZipFile

import numpy as np
import numpy.typing as npt

from bench.errors import ReportError
from bench.log import write_atomically
from bench.processes import MRBENCH_COMMAND
from bench.report.documents import Prediction, read_prediction

ARRAY_NAMES = ("time", "displacement", "velocity", "drive", "force", "simulated", "stretch", "held_out")
PREDICTION_TIMEOUT = 1800.0
"""Time limit [s] of a prediction."""


@dataclass(frozen=True)
class ForceSeries:
    """Recorded and simulated force of a log."""

    arrays: dict[str, npt.NDArray[np.generic]]
    """Arrays (N,) by name: time [s], displacement [m], velocity [m/s], drive [V or A], force and simulated [N],
    number of the stretch, and whether the sample was held out."""


def predict(fit: Path, log: Path, keep: Path | None = None) -> tuple[Prediction, ForceSeries]:
    """Simulate a fit on a log.

    Args:
        fit: fit document.
        log: recording.
        keep: file (.npz) that receives the series as well.

    Raises:
        LogError: the series cannot be written.
        ReportError: the prediction fails; the message contains that of the command.
    """
    with TemporaryDirectory(prefix="mrbench-report-") as folder:
        prediction, series = Path(folder, "prediction.json"), Path(folder, "series.npz")
        command = [*MRBENCH_COMMAND, "predict", str(fit), str(log)]
        result = _run_command([*command, "--out", str(prediction), "--series", str(series)])
        if result.returncode != 0:
            lines = result.stderr.strip().splitlines() or [f"exit status {result.returncode}"]
            raise ReportError(f"the fit cannot be simulated on {log}: {lines[-1].removeprefix('mrbench: ')}")
        if keep is not None:
            with write_atomically(keep) as partial:
                shutil.copyfile(series, partial)
        return read_prediction(prediction), read_series(series)


def read_series(path: Path) -> ForceSeries:
    """Read a series from its .npz file.

    Raises:
        ReportError: the file cannot be read, or its arrays are not those of a series.
    """
    try:
        with np.load(path) as file:
            arrays = {name: file[name] for name in ARRAY_NAMES}
    except (OSError, KeyError, ValueError, BadZipFile) as error:
        raise ReportError(f"{path}: not a series of `mrbench predict` ({error})") from error
    if len(lengths := {array.shape for array in arrays.values()}) > 1:
        raise ReportError(f"{path}: the arrays of the series differ in length ({sorted(lengths)})")
    return ForceSeries(arrays)


def _run_command(command: list[str]) -> subprocess.CompletedProcess[str]:
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=PREDICTION_TIMEOUT, check=False)
    except subprocess.TimeoutExpired as error:
        raise ReportError(
            f"the prediction was stopped at its time limit of {PREDICTION_TIMEOUT:g} s; give a shorter log"
        ) from error

"""Assessment of planned strokes by the identification, a process of its own that exchanges files.

The bench writes the exact samples of a method and of strokes that could be added to it. The identification
predicts the uncertainty of the parameters that they determine.
"""

import json
import subprocess
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from bench.errors import RunError
from bench.methods import Array, Programme, make_candidate_strokes
from bench.processes import MRBENCH_COMMAND

FORESEE_COMMAND = (*MRBENCH_COMMAND, "foresee")
"""Command that assesses planned strokes; the file and options follow."""
DESIGN_TIMEOUT = 300.0
"""[s] Timeout of the assessment; its first start compiles."""


def assess_design(
    programme: Programme, model: Path | None = None, command: Sequence[str] = FORESEE_COMMAND
) -> dict[str, Any]:
    """Return the `mrbench.foresight/1` document of a programme.

    Args:
        programme: planned strokes.
        model: fit, twin or scenario of the expected damper; a typical damper if None.
        command: assesses the strokes.

    Raises:
        RunError: the assessment fails.
    """
    with TemporaryDirectory(prefix="mrbench-") as folder:
        planned = Path(folder) / "planned.npz"
        write_planned_strokes(planned, programme)
        options = ["--model", str(model)] if model is not None else []
        return _parse_document(_run_command([*command, str(planned), "--out", "-", *options]))


def _parse_document(output: str) -> dict[str, Any]:
    try:
        document: dict[str, Any] = json.loads(output)
    except ValueError:
        raise _make_error("the output of the identification is not JSON") from None
    return document


def write_planned_strokes(path: Path, programme: Programme) -> None:
    """Write the exact samples of a programme, and of candidate strokes within its method's limits.

    Raises:
        RunError: the file cannot be written.
    """
    arrays = _make_arrays(programme)
    try:
        # An open file, because numpy adds .npz to a name without it.
        with path.open("wb") as file:
            np.savez(file, **arrays)
    except OSError as error:
        raise RunError(f"{path} cannot be written: {error.strerror}") from None


def _make_arrays(programme: Programme) -> dict[str, Any]:
    candidates = make_candidate_strokes(programme)
    info = {
        "method": programme.method.name,
        "rate_hz": programme.rate,
        "drive_unit": programme.method.drive_unit,
        "additions": [json.loads(s.model_dump_json(exclude_defaults=True)) for s, _ in candidates],
    }
    samples = {f"addition_{k}": _stack_channels(stroke) for k, (_, stroke) in enumerate(candidates)}
    return {"plan": _stack_channels(programme), **samples, "info": np.array(json.dumps(info))}


def _stack_channels(programme: Programme) -> Array:
    """Return displacement [m], velocity [m/s], acceleration [m/s²] and drive [V or A], shape (4, N)."""
    return np.stack([programme.displacement, programme.velocity, programme.acceleration, programme.drive])


def _run_command(command: list[str]) -> str:
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=DESIGN_TIMEOUT, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise _make_error(str(error)) from None
    if done.returncode != 0:
        lines = done.stderr.strip().splitlines() or [f"exit status {done.returncode}"]
        raise _make_error(lines[-1].removeprefix("mrbench: "))
    return done.stdout


def _make_error(reason: str) -> RunError:
    return RunError(f"the planned strokes were not assessed: {reason}")

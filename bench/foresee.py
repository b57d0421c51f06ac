"""What the strokes of a method can tell of a damper: asked of the identification, a process of its own on files.

The bench makes the exact samples of the method and of what could be added to it; the identification judges them.
"""

import json
import subprocess
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from bench.child_process import MRBENCH
from bench.errors import RunError
from bench.methods import Programme
from bench.methods.additions import additions
from bench.methods.kinematics import Array

FORESEE = (*MRBENCH, "foresee")
"""Command that judges planned strokes; the file and options follow."""
LONGEST = 300.0
"""[s] after which it is given up; its first start compiles."""


def foreseen(programme: Programme, model: Path | None = None, command: Sequence[str] = FORESEE) -> dict[str, Any]:
    """The `mrbench.foresight/1` document on a programme.

    Args:
        programme: the strokes.
        model: a fit, twin or scenario of the damper to expect; a usual damper if None.
        command: what judges them.

    Raises:
        RunError: it cannot be judged; the message says why.
    """
    with TemporaryDirectory(prefix="mrbench-") as folder:
        planned = Path(folder) / "planned.npz"
        write_planned(planned, programme)
        options = ["--model", str(model)] if model is not None else []
        done = _run([*command, str(planned), "--out", "-", *options])
    try:
        found: dict[str, Any] = json.loads(done)
    except ValueError:
        raise RunError("what these strokes can tell is not known: the answer is no JSON") from None
    return found


def write_planned(path: Path, programme: Programme) -> None:
    """Write the exact samples of a programme, and of what could be added to it within its method's limits.

    Raises:
        RunError: the file cannot be written.
    """
    could_be_added = additions(programme)
    info = {
        "method": programme.method.name,
        "rate_hz": programme.rate,
        "drive_unit": programme.method.drive_unit,
        "additions": [json.loads(s.model_dump_json(exclude_defaults=True)) for s, _ in could_be_added],
    }
    samples = {f"addition_{k}": _channels(added) for k, (_, added) in enumerate(could_be_added)}
    arrays: dict[str, Any] = {"plan": _channels(programme), **samples, "info": np.array(json.dumps(info))}
    try:
        # By an open file: numpy adds .npz to a name that does not end so.
        with path.open("wb") as file:
            np.savez(file, **arrays)
    except OSError as error:
        raise RunError(f"{path} cannot be written: {error.strerror}") from None


def _channels(programme: Programme) -> Array:
    """(4, N) displacement [m], velocity [m/s], acceleration [m/s²], drive [V or A]."""
    return np.stack([programme.displacement, programme.velocity, programme.acceleration, programme.drive])


def _run(command: list[str]) -> str:
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise RunError(f"what these strokes can tell is not known: {error}") from None
    if done.returncode != 0:
        lines = done.stderr.strip().splitlines() or [f"exit status {done.returncode}"]
        raise RunError(f"what these strokes can tell is not known: {lines[-1].removeprefix('mrbench: ')}")
    return done.stdout

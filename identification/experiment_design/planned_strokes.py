"""File of planned strokes, written by `mrbench run METHOD --dry-run --planned FILE.npz`.

The arrays ``plan`` and ``addition_0``, ``addition_1``, ... (4, N) contain displacement [m], velocity [m/s],
acceleration [m/s²] and drive [V or A] at one rate. ``info`` is a JSON text with ``method``, ``rate_hz``,
``drive_unit`` and ``additions``: the segment of a method for each optional stroke.
"""

import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from identification.arrays import Array
from identification.errors import IdentificationError
from identification.simulate import Excitation

_MOTION_FRACTION = 0.1
"""Threshold on the speed, as a fraction of the largest one [1]: above it, the damper counts as moving."""
_MIN_SAMPLES = 200
"""Least number of samples of a plan."""


@dataclass(frozen=True)
class OptionalStroke:
    """A stroke that may be added to the planned ones."""

    segment: dict[str, Any]
    """Segment of a method."""
    excitation: Excitation


@dataclass(frozen=True)
class PlannedStrokes:
    """Strokes of a method, and strokes that may be added to it."""

    method: str
    drive_unit: str
    """V or A."""
    excitation: Excitation
    optional_strokes: tuple[OptionalStroke, ...]


def read_planned_strokes(path: Path) -> PlannedStrokes:
    """Return the planned strokes in a file.

    Raises:
        IdentificationError: the file is missing, has another format, or contains too few samples.
    """
    try:
        with np.load(path) as file:
            return _parse_strokes(file)
    except (OSError, KeyError, ValueError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise IdentificationError(
            f"{path}: not a file of planned strokes ({error}); "
            "write one with `mrbench run METHOD --dry-run --planned FILE.npz`"
        ) from error


def _parse_strokes(file: Mapping[str, Array]) -> PlannedStrokes:
    info = json.loads(str(file["info"]))
    rate = float(info["rate_hz"])
    plan = _make_excitation(rate, file["plan"])
    optional_strokes = tuple(
        OptionalStroke(dict(segment), _make_excitation(rate, file[f"addition_{k}"]))
        for k, segment in enumerate(info["additions"])
    )
    return PlannedStrokes(str(info["method"]), str(info["drive_unit"]), plan, optional_strokes)


def _make_excitation(rate: float, channels: Array) -> Excitation:
    channels = np.asarray(channels, np.float64)
    if channels.ndim != 2 or channels.shape[0] != 4 or channels.shape[1] < _MIN_SAMPLES:
        raise ValueError(f"expected 4 channels of at least {_MIN_SAMPLES} samples, found shape {channels.shape}")
    if not np.isfinite(channels).all():
        raise ValueError("a sample is not finite")
    displacement, velocity, acceleration, drive = np.ascontiguousarray(channels)
    return Excitation(rate, displacement, velocity, acceleration, drive)


@dataclass(frozen=True)
class PlanLimitations:
    """Limitations of planned strokes that explain why a coordinate is not identifiable."""

    has_one_drive: bool
    """The drive never changes."""
    has_steps_only_at_rest: bool
    """The drive changes only while the damper is at rest."""
    has_one_velocity: bool
    """All strokes peak at about the same velocity."""


def find_plan_limitations(stroke: Excitation) -> PlanLimitations:
    """Return the limitations of a stroke: constant drive, drive changes at rest only, one peak velocity."""
    drive, velocity = stroke.sampled_drive, np.abs(stroke.velocity)
    changes = np.flatnonzero(np.abs(np.diff(drive)) > 1e-9)
    fast = velocity > _MOTION_FRACTION * float(velocity.max())
    # Peaks of each second: a sweep or a ramp of amplitude has peaks of many sizes.
    block = max(1, round(stroke.rate))
    peaks = [float(velocity[k : k + block].max()) for k in range(0, len(velocity) - block + 1, block)]
    # Seconds at rest or in a fade are no strokes.
    steady = [peak for peak in peaks if peak > 0.2 * max(peaks)] if peaks else []
    return PlanLimitations(
        has_one_drive=len(changes) == 0,
        has_steps_only_at_rest=not fast[changes].any(),
        has_one_velocity=not steady or max(steady) < 1.5 * min(steady),
    )

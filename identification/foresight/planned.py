"""The file of planned strokes that the bench writes and this room reads.

An .npz: ``plan`` and ``addition_0``, ``addition_1``, ... of shape (4, N) each hold displacement [m], velocity
[m/s], acceleration [m/s²] and drive [V or A] at one rate; ``info`` is a JSON text with ``method``, ``rate_hz``,
``drive_unit`` and ``additions``, the segment of a method behind each addition.
"""

import json
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from identification.arrays import Array
from identification.errors import IdentificationError
from identification.simulate import Stroke

_FEWEST = 200
"""[samples] in a plan."""


@dataclass(frozen=True)
class Addition:
    """A stroke that could be added."""

    segment: dict[str, Any]
    """As a method names it."""
    stroke: Stroke


@dataclass(frozen=True)
class Planned:
    """The strokes of a method, and those that could be added to it."""

    method: str
    drive_unit: str
    """V or A."""
    stroke: Stroke
    additions: tuple[Addition, ...]


def read_planned(path: Path) -> Planned:
    """Planned strokes from their file.

    Raises:
        IdentificationError: the file is missing, is of another form, or holds too little.
    """
    try:
        with np.load(path) as file:
            info = json.loads(str(file["info"]))
            rate = float(info["rate_hz"])
            plan = _stroke(rate, file["plan"])
            additions = [
                Addition(dict(segment), _stroke(rate, file[f"addition_{k}"]))
                for k, segment in enumerate(info["additions"])
            ]
            return Planned(str(info["method"]), str(info["drive_unit"]), plan, tuple(additions))
    except (OSError, KeyError, ValueError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise IdentificationError(
            f"{path}: no planned strokes ({error}); `mrbench run METHOD --dry-run` makes and reads them"
        ) from error


def _stroke(rate: float, channels: Array) -> Stroke:
    channels = np.asarray(channels, np.float64)
    if channels.ndim != 2 or channels.shape[0] != 4 or channels.shape[1] < _FEWEST:
        raise ValueError(f"four channels of at least {_FEWEST} samples are needed, not {channels.shape}")
    if not np.isfinite(channels).all():
        raise ValueError("a sample is not finite")
    displacement, velocity, acceleration, drive = np.ascontiguousarray(channels)
    return Stroke(rate, displacement, velocity, acceleration, drive)

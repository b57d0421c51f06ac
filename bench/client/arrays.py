"""Samples of a run as arrays with units."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt

from bench.log import read_log

Array = npt.NDArray[np.float64] | npt.NDArray[np.int64]
_TIME = "time"
"""Channel with the time since the first sample [s]."""


class Arrays(Mapping[str, Array]):
    """Samples by channel, each of shape (samples,); a missing value is NaN, a missing segment is -1.

    Args:
        values: samples by channel.
        units: unit by channel.
    """

    def __init__(self, values: Mapping[str, Array], units: Mapping[str, str]) -> None:
        self._values = dict(values)
        self.units = {name: units[name] for name in self._values}

    def __getitem__(self, name: str) -> Array:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __repr__(self) -> str:
        channels = ", ".join(f"{name} [{unit}]" for name, unit in self.units.items())
        return f"Arrays({len(self._values[_TIME])} samples: {channels})"


def read_arrays(log: Path) -> Arrays:
    """Read the samples of a log.

    Raises:
        LogError: the log is truncated, damaged or without samples.
    """
    content = read_log(log)
    units = {_TIME: "s", "time_ns": "ns", **content.metadata["units"]}
    names = [_TIME, *(name for name in content.samples if name != _TIME)]
    return Arrays({name: content.samples[name] for name in names}, units)

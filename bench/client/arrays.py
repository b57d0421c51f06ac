"""Samples of a run as arrays with units."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from bench.client.errors import ClientError
from bench.samples import decode_batches

Array = npt.NDArray[np.float64] | npt.NDArray[np.int64]
_TIME = "time"
"""Channel with the time since the first returned sample [s]."""
_SEGMENT = "segment"


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


def make_arrays(content: bytes, channels: Sequence[Mapping[str, str]]) -> Arrays:
    """Return the samples in a reply of the service.

    Args:
        content: binary batches.
        channels: name and unit of each channel, the time first.

    Raises:
        ClientError: the reply is incomplete or of another version.
    """
    try:
        time, columns = decode_batches(content, len(channels))
    except ValueError as error:
        raise ClientError(
            f"the samples cannot be read ({error}); use a client of the service's version"
        ) from error
    values: dict[str, Array] = {_TIME: time - time[0] if len(time) else time}
    for channel, column in zip(channels[1:], columns, strict=True):
        is_number = channel["name"] == _SEGMENT
        values[channel["name"]] = column.astype(np.int64) if is_number else column.astype(np.float64)
    return Arrays(values, {channel["name"]: channel["unit"] for channel in channels})

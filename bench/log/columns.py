"""Fast conversion of many samples to JSON.

orjson converts a whole column of numbers at once, and each message is assembled from these bytes. This is six
times as fast as one dictionary per sample and gives the same bytes.
"""

from collections.abc import Iterable, Iterator, Mapping

import numpy as np
import numpy.typing as npt
import orjson

from bench.errors import LogError
from bench.log.messages import NS_PER_SECOND, REQUIRED_FIELDS, SAMPLE_FIELDS

Column = npt.NDArray[np.float64] | npt.NDArray[np.int64]

_BATCH_SIZE = 50_000
"""Number of samples that are converted at a time; limits the memory."""


def check_fields(names: Iterable[str]) -> list[str]:
    """Return the names in the order of a sample's fields.

    Raises:
        LogError: a name is not a field of a sample, or a required field is missing.
    """
    present = set(names)
    if unknown := sorted(present - set(SAMPLE_FIELDS)):
        raise LogError(f"sample: there is no field {unknown[0]}; the fields are {', '.join(SAMPLE_FIELDS)}")
    if missing := [name for name in REQUIRED_FIELDS if name not in present]:
        raise LogError(f"sample: {missing[0]} is missing; every sample needs {', '.join(REQUIRED_FIELDS)}")
    return [name for name in SAMPLE_FIELDS if name in present]


def make_sample_messages(
    time_ns: npt.NDArray[np.int64], values: Mapping[str, npt.ArrayLike]
) -> Iterator[tuple[int, bytes]]:
    """Yield time [ns] and JSON of each sample.

    Args:
        time_ns: bench clock [ns], shape (samples,).
        values: values by field, each of shape (samples,). A field that is NaN, or a negative segment, is omitted
            from that sample; only optional fields may be NaN.

    Raises:
        LogError: a field is unknown, missing, of another length or not finite, or time does not increase.
    """
    names = check_fields(values)
    if (np.diff(time_ns) <= 0).any():
        row = int(np.argmax(np.diff(time_ns) <= 0))
        raise make_not_increasing_error(int(time_ns[row]), int(time_ns[row + 1]))
    columns = {name: _make_column(name, values[name], time_ns) for name in names}
    template = b'{"timestamp":{"sec":%b,"nsec":%b}' + b"%b" * len(columns) + b"}"
    for first in range(0, len(time_ns), _BATCH_SIZE):
        part = slice(first, first + _BATCH_SIZE)
        seconds, nanoseconds = np.divmod(time_ns[part], NS_PER_SECOND)
        texts = [_serialise_column(name, column[part]) for name, column in columns.items()]
        rows = zip(_serialise_numbers(seconds), _serialise_numbers(nanoseconds), *texts, strict=True)
        yield from zip(time_ns[part].tolist(), (template % row for row in rows), strict=True)


def _make_column(name: str, values: npt.ArrayLike, time_ns: npt.NDArray[np.int64]) -> Column:
    column: Column = np.asarray(values, dtype=np.float64)
    if name == "segment":
        column = column.astype(np.int64)
    if column.shape != time_ns.shape:
        raise LogError(
            f"sample: {name} has shape {column.shape}, the time {time_ns.shape}; give one value per sample"
        )
    if name in REQUIRED_FIELDS and not np.isfinite(column).all():
        row = int(np.argmin(np.isfinite(column)))
        raise make_not_finite_error(name, float(column[row]), int(time_ns[row]))
    return column


def make_not_finite_error(name: str, value: float, time_ns: int) -> LogError:
    """Return the error for a required value that is not finite."""
    return LogError(f"sample: {name} is {value} at {time_ns / NS_PER_SECOND:.6f} s; record finite numbers only")


def make_not_increasing_error(before: int, time_ns: int) -> LogError:
    """Return the error for a sample that is not later than the one before."""
    times = f"sample at {time_ns / NS_PER_SECOND:.6f} s after one at {before / NS_PER_SECOND:.6f} s"
    return LogError(f"{times}; the bench clock starts at zero or later and increases")


def _serialise_numbers(column: Column) -> list[bytes]:
    return orjson.dumps(np.ascontiguousarray(column), option=orjson.OPT_SERIALIZE_NUMPY)[1:-1].split(b",")


def _serialise_column(name: str, column: Column) -> list[bytes]:
    """Return one column as bytes: ``,"name":value``, or nothing for a sample without this value."""
    key = f',"{name}":'.encode()
    absent = column < 0 if name == "segment" else ~np.isfinite(column)
    texts = [key + number for number in _serialise_numbers(column)]
    for row in np.flatnonzero(absent):
        texts[row] = b""
    return texts

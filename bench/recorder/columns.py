"""Samples as JSON, many at once.

orjson writes a whole column of numbers in one go; a message is then put together from pieces of bytes. This is
six times as fast as one dictionary a sample, and gives the same bytes.
"""

from collections.abc import Iterable, Iterator, Mapping

import numpy as np
import numpy.typing as npt
import orjson

from bench.errors import LogError
from bench.recorder.messages import REQUIRED_FIELDS, SAMPLE_FIELDS

SECOND = 1_000_000_000
"""[ns]"""

Column = npt.NDArray[np.float64] | npt.NDArray[np.int64]

_PORTION = 50_000
"""Samples put together at a time; bounds the memory."""


def checked_fields(names: Iterable[str]) -> list[str]:
    """The names in the order of a sample's fields.

    Raises:
        LogError: a name is no field of a sample, or a required one is missing.
    """
    given = set(names)
    if unknown := sorted(given - set(SAMPLE_FIELDS)):
        raise LogError(f"sample: no field is called {unknown[0]}; the fields are {', '.join(SAMPLE_FIELDS)}")
    if missing := [name for name in REQUIRED_FIELDS if name not in given]:
        raise LogError(f"sample: {missing[0]} is missing; every sample has {', '.join(REQUIRED_FIELDS)}")
    return [name for name in SAMPLE_FIELDS if name in given]


def sample_messages(
    time_ns: npt.NDArray[np.int64], values: Mapping[str, npt.ArrayLike]
) -> Iterator[tuple[int, bytes]]:
    """Time [ns] and JSON of each sample.

    Args:
        time_ns: bench clock [ns], shape (samples,).
        values: by field, each of shape (samples,). A NaN in an optional field, or a negative segment, leaves
            the field out of that sample.

    Raises:
        LogError: a field is unknown, missing, of another length or not finite, or time does not increase.
    """
    names = checked_fields(values)
    if (np.diff(time_ns) <= 0).any():
        row = int(np.argmax(np.diff(time_ns) <= 0))
        raise not_increasing(int(time_ns[row]), int(time_ns[row + 1]))
    columns = {name: _column(name, values[name], time_ns) for name in names}
    form = b'{"timestamp":{"sec":%b,"nsec":%b}' + b"%b" * len(columns) + b"}"
    for first in range(0, len(time_ns), _PORTION):
        part = slice(first, first + _PORTION)
        seconds, rest = np.divmod(time_ns[part], SECOND)
        pieces = [_pieces(name, column[part]) for name, column in columns.items()]
        rows = zip(_numbers(seconds), _numbers(rest), *pieces, strict=True)
        yield from zip(time_ns[part].tolist(), (form % row for row in rows), strict=True)


def _column(name: str, values: npt.ArrayLike, time_ns: npt.NDArray[np.int64]) -> Column:
    column: Column = np.asarray(values, dtype=np.float64)
    if name == "segment":
        column = column.astype(np.int64)
    if column.shape != time_ns.shape:
        raise LogError(
            f"sample: {name} has shape {column.shape}, the time {time_ns.shape}; give one value a sample"
        )
    if name in REQUIRED_FIELDS and not np.isfinite(column).all():
        row = int(np.argmin(np.isfinite(column)))
        raise not_finite(name, float(column[row]), int(time_ns[row]))
    return column


def not_finite(name: str, value: float, time_ns: int) -> LogError:
    """The error for a required value that is no number."""
    return LogError(f"sample: {name} is {value} at {time_ns / SECOND:.6f} s; record finite numbers only")


def not_increasing(before: int, time_ns: int) -> LogError:
    """The error for a sample that is not later than the one before."""
    times = f"sample at {time_ns / SECOND:.6f} s after one at {before / SECOND:.6f} s"
    return LogError(f"{times}; the bench clock starts at zero or later and increases")


def _numbers(column: Column) -> list[bytes]:
    return orjson.dumps(np.ascontiguousarray(column), option=orjson.OPT_SERIALIZE_NUMPY)[1:-1].split(b",")


def _pieces(name: str, column: Column) -> list[bytes]:
    """One column as bytes: ``,"name":value``, or nothing where the sample has no such value."""
    head = f',"{name}":'.encode()
    absent = column < 0 if name == "segment" else ~np.isfinite(column)
    pieces = [head + number for number in _numbers(column)]
    for row in np.flatnonzero(absent):
        pieces[row] = b""
    return pieces

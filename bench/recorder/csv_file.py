"""Recordings made elsewhere, as text: ``time_s, displacement_m, force_n`` and one of ``voltage_v | current_a``.

The whole table is read by numpy's parser; only where that fails, or a value cannot stand, is the file gone
through again line by line, to say which cell is at fault.
"""

import csv
import gzip
import math
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from bench.errors import RecordingError

Array = npt.NDArray[np.float64]

REQUIRED = ("time_s", "displacement_m", "force_n")
DRIVES: dict[str, Literal["V", "A"]] = {"voltage_v": "V", "current_a": "A"}
OPTIONAL = ("velocity_mps", "temperature_c")
NAMES = (*REQUIRED, *DRIVES, *OPTIONAL)

DRIVE_KINDS: dict[str, Literal["V", "A"]] = {"driver_command_v": "V", "coil_v": "V", "coil_a": "A"}
"""Unit by kind of drive."""

FEWEST = 200
"""Samples below which a recording tells nothing."""


@dataclass(frozen=True)
class CsvRecording:
    """One file, checked."""

    name: str
    """The file's name without its endings."""
    time_ns: npt.NDArray[np.int64]
    """From the first sample [ns], increasing, shape (samples,)."""
    displacement: Array
    """[m], shape (samples,)."""
    force: Array
    """[N], shape (samples,)."""
    drive: Array
    """[V or A], shape (samples,)."""
    drive_unit: Literal["V", "A"]
    velocity: Array | None = None
    """[m/s], shape (samples,), where the file has it."""
    temperature: Array | None = None
    """[degC], shape (samples,), where the file has it."""

    @property
    def rate(self) -> float:
        """[Hz], from the median step of time."""
        return 1e9 / float(np.median(np.diff(self.time_ns)))


def read_csv(path: Path, headers: Mapping[str, str] | None = None, drive_kind: str | None = None) -> CsvRecording:
    """Read and check one file.

    Args:
        path: text, or text compressed by gzip; its first line names the columns.
        headers: the file's own header by our name, where they differ.
        drive_kind: one of `DRIVE_KINDS`; says which drive to take where the file has both.

    Raises:
        RecordingError: the file cannot be read, a column is missing, a cell is no finite number, time does not
            increase, or there are fewer than 200 samples. The message names file, line and column.
    """
    lines = _lines(path)
    columns = _columns(path, lines[0], headers or {}, drive_kind)
    table = _table(path, lines, columns)
    time_ns = np.round((table["time_s"] - table["time_s"][0]) * 1e9).astype(np.int64)
    if (np.diff(time_ns) <= 0).any():
        row = int(np.argmax(np.diff(time_ns) <= 0)) + 1
        at = f"{path.name}, row {_line_numbers(lines)[row]}, column {_header('time_s', headers or {})}"
        times = f"{table['time_s'][row]:.10g} s after {table['time_s'][row - 1]:.10g} s"
        raise RecordingError(f"{at}: {times}; time must increase from row to row")
    drive = next(name for name in DRIVES if name in columns)
    return CsvRecording(
        name=path.name.removesuffix(".gz").removesuffix(".csv"),
        time_ns=time_ns,
        displacement=table["displacement_m"],
        force=table["force_n"],
        drive=table[drive],
        drive_unit=DRIVES[drive],
        velocity=table.get("velocity_mps"),
        temperature=table.get("temperature_c"),
    )


def _lines(path: Path) -> list[str]:
    """The file's lines, of which the first is not empty."""
    try:
        # Compressed or not is seen by the first bytes; spreadsheets put a mark before UTF-8.
        data = path.read_bytes()
        text = (gzip.decompress(data) if data[:2] == b"\x1f\x8b" else data).decode("utf-8-sig")
    except (gzip.BadGzipFile, EOFError, zlib.error) as error:
        raise RecordingError(f"{path.name}: the gzip file is damaged ({error}); copy it again") from error
    except OSError as error:
        raise RecordingError(f"{path}: {(error.strerror or str(error)).lower()}") from error
    except UnicodeDecodeError as error:
        row = data[: error.start].count(b"\n") + 1
        raise RecordingError(f"{path.name}, row {row}: no text; save the table as CSV in UTF-8") from error
    lines = text.splitlines()
    if not lines or not lines[0].strip():
        raise RecordingError(f"{path.name}, row 1: no header; the first row names the columns")
    return lines


def _header(name: str, headers: Mapping[str, str]) -> str:
    return headers.get(name, name)


def _columns(path: Path, first: str, headers: Mapping[str, str], drive_kind: str | None) -> dict[str, int]:
    """Place of each column in the file, by our name."""
    found = [cell.strip() for cell in next(csv.reader([first]))]
    drives = [name for name in DRIVES if _header(name, headers) in found]
    if len(drives) > 1 and drive_kind is not None:
        drives = [name for name in drives if DRIVES[name] == DRIVE_KINDS[drive_kind]]
    if len(drives) > 1:
        raise RecordingError(
            f"{path.name}, row 1: both {' and '.join(DRIVES)}; say which one drives the damper with --drive-kind"
        )
    wanted = [*REQUIRED, *(name for name in OPTIONAL if _header(name, headers) in found), *drives]
    missing = [name for name in (*wanted, *headers) if _header(name, headers) not in found]
    if not drives:
        missing.append(" or ".join(DRIVES))
    if missing:
        asked = ", ".join(dict.fromkeys(_header(name, headers) for name in missing))
        help_ = f"map it with --column {missing[0].split()[0]}=HEADER"
        raise RecordingError(f"{path.name}, row 1: no column {asked}; the file has {', '.join(found)}; {help_}")
    for name in wanted:
        if found.count(_header(name, headers)) > 1:
            raise RecordingError(f"{path.name}, row 1: column {_header(name, headers)} stands there twice")
    return {name: found.index(_header(name, headers)) for name in wanted}


def _table(path: Path, lines: Sequence[str], columns: Mapping[str, int]) -> dict[str, Array]:
    """The columns as arrays, all finite."""
    body = "\n".join(lines[1:])
    if not body.strip():
        raise RecordingError(f"{path.name}: 0 samples, fewer than {FEWEST}; record for longer")
    try:
        table = np.loadtxt(
            StringIO(body), delimiter=",", usecols=list(columns.values()), comments=None, quotechar='"', ndmin=2
        )
    except ValueError as error:
        raise _fault(path, lines, columns, str(error)) from error
    if not np.isfinite(table).all():
        raise _fault(path, lines, columns, "not finite")
    if len(table) < FEWEST:
        last = _line_numbers(lines)[-1]
        raise RecordingError(
            f"{path.name}, row {last}: {len(table)} samples, fewer than {FEWEST}; record for longer"
        )
    return {name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(columns)}


def _line_numbers(lines: Sequence[str]) -> list[int]:
    """Line of each sample in the file, whose header is line 1."""
    return [number for number, line in enumerate(lines, 1) if number > 1 and line.strip()]


def _fault(path: Path, lines: Sequence[str], columns: Mapping[str, int], reason: str) -> RecordingError:
    """The error for the first cell that is no finite number."""
    header = [cell.strip() for cell in next(csv.reader([lines[0]]))]
    for number in _line_numbers(lines):
        cells = next(csv.reader([lines[number - 1]]))
        for place in columns.values():
            if fault := _cell_fault(cells, place):
                return RecordingError(f"{path.name}, row {number}, column {header[place]}: {fault}")
    return RecordingError(f"{path.name}: {reason}")


def _cell_fault(cells: Sequence[str], place: int) -> str | None:
    if place >= len(cells):
        return f"the row ends after {len(cells)} cells; give a number"
    text = cells[place].strip()
    try:
        value = float(text.replace("_", "?"))  # Python would read 1_000 as a number, numpy does not
    except ValueError:
        return f"{text!r} is no number" if text else "the cell is empty; give a number"
    return None if math.isfinite(value) else f"{text} is no finite number; leave the row out or repair it"

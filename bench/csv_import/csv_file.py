"""CSV recordings: ``time_s, displacement_m, force_n`` and one of ``voltage_v | current_a``.

Headers, units and senses may differ from those of a log; they are stated by the user and converted here.

numpy parses the whole table. Only if that fails, or a value is invalid, the file is read again line by line to
find the cell at fault.
"""

import csv
import gzip
import math
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO, StringIO
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from bench.csv_import.sampling_clock import restore_sampling_clock
from bench.csv_import.units import Conversion
from bench.errors import RecordingError

Array = npt.NDArray[np.float64]

REQUIRED_COLUMNS = ("time_s", "displacement_m", "force_n")
DRIVE_COLUMNS: dict[str, Literal["V", "A"]] = {"voltage_v": "V", "current_a": "A"}
OPTIONAL_COLUMNS = ("velocity_mps", "temperature_c")
COLUMN_NAMES = (*REQUIRED_COLUMNS, *DRIVE_COLUMNS, *OPTIONAL_COLUMNS)

DRIVE_KINDS: dict[str, Literal["V", "A"]] = {"driver_command_v": "V", "coil_v": "V", "coil_a": "A"}
"""Unit of each kind of drive."""

MIN_SAMPLES = 200
"""Smallest number of samples of a recording."""
OTHER_DELIMITERS = ("\t", ";")
"""Delimiters besides the comma. With them a comma in a number is its decimal sign."""
MAX_SIZE = 2_000_000_000
"""Largest size of a decompressed file [bytes]."""


@dataclass(frozen=True)
class CsvRecording:
    """Content of one checked file; arrays have shape (samples,)."""

    name: str
    """File name without endings."""
    time_ns: npt.NDArray[np.int64]
    """Time since the first sample [ns], increasing."""
    displacement: Array
    """[m]"""
    force: Array
    """[N]"""
    drive: Array
    """[V or A]"""
    drive_unit: Literal["V", "A"]
    velocity: Array | None = None
    """[m/s]; None if the file has no such column."""
    temperature: Array | None = None
    """[degC]; None if the file has no such column."""
    note: str = ""
    """Reason for other instants than those in the file, for a person; empty if they were kept."""

    @property
    def rate(self) -> float:
        """Sampling rate [Hz], from the median time step."""
        return 1e9 / float(np.median(np.diff(self.time_ns)))


def read_csv(
    path: Path,
    headers: Mapping[str, str] | None = None,
    drive_kind: str | None = None,
    conversions: Mapping[str, Conversion] | None = None,
) -> CsvRecording:
    """Read and check one file.

    Args:
        path: CSV file, plain or compressed by gzip; the first line contains the headers. Cells are separated by
            commas, semicolons or tabs; with the last two, numbers may have decimal commas.
        headers: header in the file by column name, where they differ.
        drive_kind: one of `DRIVE_KINDS`; selects the drive if the file has both.
        conversions: of columns whose unit or sense differs, by column name.

    Raises:
        RecordingError: the file cannot be read, a column is missing, a cell is not a finite number, time does not
            increase although it is not rounded, or there are fewer than 200 samples. The message names file, line
            and column.
    """
    lines = _read_lines(path)
    columns = _find_columns(path, lines[0], headers or {}, drive_kind)
    table = _convert(path, _parse_table(path, lines, columns), conversions or {})
    clock = restore_sampling_clock(table["time_s"], table["displacement_m"])
    time_ns = np.round((clock.time - clock.time[0]) * 1e9).astype(np.int64)
    if (np.diff(time_ns) <= 0).any():
        row = int(np.argmax(np.diff(time_ns) <= 0)) + 1
        cell = f"{path.name}, row {_find_line_numbers(lines)[row]}, column {_get_header('time_s', headers or {})}"
        times = f"{table['time_s'][row]:.10g} s after {table['time_s'][row - 1]:.10g} s"
        raise RecordingError(f"{cell}: {times}; time must increase from row to row")
    drive = next(name for name in DRIVE_COLUMNS if name in columns)
    return CsvRecording(
        name=path.name.removesuffix(".gz").removesuffix(".csv"),
        time_ns=time_ns,
        displacement=table["displacement_m"],
        force=table["force_n"],
        drive=table[drive],
        drive_unit=DRIVE_COLUMNS[drive],
        velocity=table.get("velocity_mps"),
        temperature=table.get("temperature_c"),
        note=clock.note,
    )


def _read_lines(path: Path) -> list[str]:
    """Read the lines of a file; the first one is not empty."""
    try:
        data = path.read_bytes()
        # gzip is recognised by its first bytes. Spreadsheets write a byte order mark before UTF-8.
        text = (_decompress(path, data) if data[:2] == b"\x1f\x8b" else data).decode("utf-8-sig")
    except (gzip.BadGzipFile, EOFError, zlib.error) as error:
        raise RecordingError(f"{path.name}: the gzip file is damaged ({error}); copy it again") from error
    except OSError as error:
        raise RecordingError(f"{path}: {(error.strerror or str(error)).lower()}") from error
    except UnicodeDecodeError as error:
        row = data[: error.start].count(b"\n") + 1
        raise RecordingError(f"{path.name}, row {row}: not UTF-8 text; save the table as CSV in UTF-8") from error
    lines = text.splitlines()
    if not lines or not lines[0].strip():
        raise RecordingError(f"{path.name}, row 1: no header; write the column names into the first row")
    delimiter = next((one for one in OTHER_DELIMITERS if one in lines[0]), "")
    return _separate_by_commas(lines, delimiter) if delimiter else lines


def _separate_by_commas(lines: Sequence[str], delimiter: str) -> list[str]:
    """Return the lines of another delimiter with commas, and with points as decimal signs."""
    header = StringIO()
    csv.writer(header, lineterminator="").writerow(next(csv.reader([lines[0]], delimiter=delimiter)))
    return [header.getvalue(), *(line.replace(",", ".").replace(delimiter, ",") for line in lines[1:])]


def _decompress(path: Path, data: bytes) -> bytes:
    """Decompress at most `MAX_SIZE`: a small file may hide one that no memory can hold."""
    text = gzip.GzipFile(fileobj=BytesIO(data)).read(MAX_SIZE + 1)
    if len(text) > MAX_SIZE:
        raise RecordingError(f"{path.name}: more than {MAX_SIZE} bytes; divide the recording into several files")
    return text


def _get_header(name: str, headers: Mapping[str, str]) -> str:
    return headers.get(name, name)


def _find_columns(path: Path, first: str, headers: Mapping[str, str], drive_kind: str | None) -> dict[str, int]:
    """Return the index of each column in the file."""
    cells = [cell.strip() for cell in next(csv.reader([first]))]
    drives = [name for name in DRIVE_COLUMNS if _get_header(name, headers) in cells]
    if len(drives) > 1 and drive_kind is not None:
        drives = [name for name in drives if DRIVE_COLUMNS[name] == DRIVE_KINDS[drive_kind]]
    if len(drives) > 1:
        names = " and ".join(DRIVE_COLUMNS)
        raise RecordingError(f"{path.name}, row 1: both {names}; select the drive of the damper with --drive-kind")
    columns = [
        *REQUIRED_COLUMNS,
        *(name for name in OPTIONAL_COLUMNS if _get_header(name, headers) in cells),
        *drives,
    ]
    missing = [name for name in (*columns, *headers) if _get_header(name, headers) not in cells]
    if not drives:
        missing.append(" or ".join(DRIVE_COLUMNS))
    if missing:
        names = ", ".join(dict.fromkeys(_get_header(name, headers) for name in missing))
        advice = f"map it with --column {missing[0].split()[0]}=HEADER"
        raise RecordingError(f"{path.name}, row 1: no column {names}; the file has {', '.join(cells)}; {advice}")
    for name in columns:
        if cells.count(_get_header(name, headers)) > 1:
            raise RecordingError(f"{path.name}, row 1: column {_get_header(name, headers)} appears twice")
    return {name: cells.index(_get_header(name, headers)) for name in columns}


def _parse_table(path: Path, lines: Sequence[str], columns: Mapping[str, int]) -> dict[str, Array]:
    """Return the columns as arrays of finite numbers."""
    body = "\n".join(lines[1:])
    if not body.strip():
        raise RecordingError(f"{path.name}: 0 samples, fewer than {MIN_SAMPLES}; record for longer")
    try:
        table = np.loadtxt(
            StringIO(body), delimiter=",", usecols=list(columns.values()), comments=None, quotechar='"', ndmin=2
        )
    except ValueError as error:
        raise _make_cell_error(path, lines, columns, str(error)) from error
    if not np.isfinite(table).all():
        raise _make_cell_error(path, lines, columns, "not finite")
    if len(table) < MIN_SAMPLES:
        last = _find_line_numbers(lines)[-1]
        raise RecordingError(
            f"{path.name}, row {last}: {len(table)} samples, fewer than {MIN_SAMPLES}; record for longer"
        )
    return {name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(columns)}


def _convert(path: Path, table: Mapping[str, Array], conversions: Mapping[str, Conversion]) -> dict[str, Array]:
    """Return the columns in the units and senses of a log."""
    for name in conversions:
        if name not in table:
            reason = f"no column {name}, whose unit or sense was given; leave that out"
            raise RecordingError(f"{path.name}, row 1: {reason}")
    return {**table, **{name: conversion.apply(table[name]) for name, conversion in conversions.items()}}


def _find_line_numbers(lines: Sequence[str]) -> list[int]:
    """Return the line number of each sample; the header is line 1."""
    return [number for number, line in enumerate(lines, 1) if number > 1 and line.strip()]


def _make_cell_error(path: Path, lines: Sequence[str], columns: Mapping[str, int], reason: str) -> RecordingError:
    """Return the error for the first cell that is not a finite number."""
    header = [cell.strip() for cell in next(csv.reader([lines[0]]))]
    for number in _find_line_numbers(lines):
        cells = next(csv.reader([lines[number - 1]]))
        for column in columns.values():
            if fault := _check_cell(cells, column):
                return RecordingError(f"{path.name}, row {number}, column {header[column]}: {fault}")
    return RecordingError(f"{path.name}: {reason}")


def _check_cell(cells: Sequence[str], column: int) -> str | None:
    if column >= len(cells):
        return f"the row ends after {len(cells)} cells; give a number"
    text = cells[column].strip()
    try:
        value = float(text.replace("_", "?"))  # Python accepts 1_000 as a number, numpy does not
    except ValueError:
        return f"{text!r} is not a number" if text else "the cell is empty; give a number"
    return None if math.isfinite(value) else f"{text} is not a finite number; delete the row or repair it"

"""Export of samples to CSV, Parquet and MATLAB files, with the unit in every column name.

An exported CSV can be imported again.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from bench.errors import LogError
from bench.log.atomic_file import write_atomically
from bench.log.reader import Log

Format: TypeAlias = Literal["csv", "parquet", "mat"]
FORMATS: tuple[Format, ...] = get_args(Format)

Columns: TypeAlias = dict[str, npt.NDArray[np.float64] | npt.NDArray[np.int64]]

_DRIVE_COLUMNS = {"V": "voltage_v", "A": "current_a"}

_COLUMN_NAMES = {
    "time": "time_s",
    "displacement": "displacement_m",
    "velocity": "velocity_mps",
    "force": "force_n",
    "coil_drive": "{drive}",
    "displacement_command": "displacement_command_m",
    "coil_drive_command": "{drive}_command",
    "actuator_position": "actuator_position_m",
    "coil_current": "coil_current_a",
    "coil_voltage": "coil_voltage_v",
    "temperature": "temperature_c",
    "force_raw": "force_raw_n",
    "segment": "segment",
}

_SMOOTHED_VELOCITY = "velocity_smoothed_mps"
"""Column of a velocity computed from displacement; the importer ignores it, because it was not measured."""


def make_columns(log: Log) -> Columns:
    """Return the samples by column name, in the order of the columns."""
    drive = _DRIVE_COLUMNS[log.metadata["run"]["drive_unit"]]
    names = dict(_COLUMN_NAMES)
    if log.metadata["units"].get("velocity_from") != "measured":
        names["velocity"] = _SMOOTHED_VELOCITY
    return {column.format(drive=drive): log.samples[name] for name, column in names.items() if name in log.samples}


def export_log(log: Log, file_format: Format, out: Path) -> None:
    """Write the samples of a log to a file, which appears complete or not at all.

    Args:
        log: log to export.
        file_format: csv, parquet or mat.
        out: file to write.

    Raises:
        LogError: the file cannot be written, or the package for the format is not installed.
    """
    writers: dict[Format, Callable[[Columns, Path], None]] = {
        "csv": _write_csv,
        "parquet": _write_parquet,
        "mat": _write_mat,
    }
    with write_atomically(out) as partial:
        writers[file_format](make_columns(log), partial)


def _write_csv(table: Columns, path: Path) -> None:
    """Write numbers with the fewest digits that restore them exactly, and empty cells for missing values."""
    texts = [_format_column(column) for column in table.values()]
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(table) + "\n")
        file.writelines(",".join(row) + "\n" for row in zip(*texts, strict=True))


def _format_column(column: npt.NDArray[np.float64] | npt.NDArray[np.int64]) -> list[str]:
    if column.dtype.kind == "i":
        return [str(value) if value >= 0 else "" for value in column.tolist()]
    return [repr(value) if value == value else "" for value in column.tolist()]  # NaN differs from itself


def _write_parquet(table: Columns, path: Path) -> None:
    try:
        import pyarrow as arrow
        from pyarrow import parquet
    except ImportError as error:
        raise LogError("export to parquet needs pyarrow; run `pip install 'mrbench[export]'`") from error
    parquet.write_table(arrow.table(dict(table)), path)


def _write_mat(table: Columns, path: Path) -> None:
    from scipy.io import savemat

    savemat(str(path), dict(table), appendmat=False, do_compression=True, oned_as="column")

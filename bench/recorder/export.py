"""Hands the samples of a log to other tools, with the unit in every column's name.

A CSV written here can be imported again. Columns that are no contracted ones follow, named in the same way.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from bench.errors import LogError
from bench.recorder.reader import Log
from bench.recorder.replacement import replacing

Format: TypeAlias = Literal["csv", "parquet", "mat"]
FORMATS: tuple[Format, ...] = get_args(Format)

Columns: TypeAlias = dict[str, npt.NDArray[np.float64] | npt.NDArray[np.int64]]

_DRIVE_NAMES = {"V": "voltage_v", "A": "current_a"}

_NAMES = {
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

_MADE_VELOCITY = "velocity_smoothed_mps"
"""Not the importer's column: a velocity made from the displacement must not come back as a measured one."""


def columns(log: Log) -> Columns:
    """The samples by column, in the order of the columns.

    Args:
        log: a log that was read.
    """
    drive = _DRIVE_NAMES[log.metadata["run"]["drive_unit"]]
    names = dict(_NAMES)
    if log.metadata["units"].get("velocity_from") != "measured":
        names["velocity"] = _MADE_VELOCITY
    return {form.format(drive=drive): log.samples[name] for name, form in names.items() if name in log.samples}


def export_log(log: Log, form: Format, out: Path) -> None:
    """Write the samples of a log to a file; it appears whole or not at all.

    Args:
        log: a log that was read.
        form: csv, parquet or mat.
        out: the file.

    Raises:
        LogError: the file cannot be written, or what writes the format is not installed.
    """
    writers: dict[Format, Callable[[Columns, Path], None]] = {
        "csv": _write_csv,
        "parquet": _write_parquet,
        "mat": _write_mat,
    }
    with replacing(out) as beside:
        writers[form](columns(log), beside)


def _write_csv(table: Columns, path: Path) -> None:
    """Every number in the fewest digits that give it back exactly; nothing where there is no value."""
    texts = [_texts(column) for column in table.values()]
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(table) + "\n")
        file.writelines(",".join(row) + "\n" for row in zip(*texts, strict=True))


def _texts(column: npt.NDArray[np.float64] | npt.NDArray[np.int64]) -> list[str]:
    if column.dtype.kind == "i":
        return [str(value) if value >= 0 else "" for value in column.tolist()]
    return [repr(value) if value == value else "" for value in column.tolist()]  # NaN alone differs from itself


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

"""Import of recordings from other test benches: CSV files to a log with segments."""

from bench.csv_import.csv_file import COLUMN_NAMES, DRIVE_KINDS
from bench.csv_import.importer import import_recordings
from bench.csv_import.units import REVERSIBLE_COLUMNS, UNITS

__all__ = [
    "COLUMN_NAMES",
    "DRIVE_KINDS",
    "REVERSIBLE_COLUMNS",
    "UNITS",
    "import_recordings",
]

"""Report as a workbook (XLSX): raw samples, derived values, results and definitions, as numbers in SI units."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from xlsxwriter import Workbook
from xlsxwriter.exceptions import XlsxWriterException
from xlsxwriter.worksheet import Worksheet

from bench.errors import ReportError
from bench.log import Log, make_columns
from bench.report.diagnosis import Diagnosis
from bench.report.documents import DriveError, Estimate, Fit
from bench.report.formats.definitions import list_definitions
from bench.report.formats.derived import QUANTITIES, derive_strokes

Row = Sequence[str | float | int | None]
_MAX_ROWS = 1_000_000
"""Largest number of samples of one sheet; a sheet has 1 048 576 rows."""
_WIDTH = 20
"""Width of the columns [characters]."""


def write_workbook(
    context: Mapping[str, Any], log: Log, fit: Fit | None, diagnosis: Diagnosis | None, path: Path
) -> None:
    """Write a workbook on a recording.

    Args:
        context: values of the page's template.
        log: recording, with its samples.
        fit: identified damper, or None.
        diagnosis: diagnosis of the gap, or None.
        path: file to write.

    Raises:
        ReportError: the file cannot be written.
    """
    # Rows leave the memory at once, so that a long recording needs no more than a short one.
    book = Workbook(str(path), {"constant_memory": True, "nan_inf_to_errors": True, "in_memory": False})
    for title, rows in _list_tables(context, log, fit, diagnosis):
        _write_sheet(book, title, rows)
    _write_samples(book, log)
    try:
        book.close()
    except (OSError, XlsxWriterException) as error:
        raise ReportError(f"{path}: the workbook cannot be written ({error})") from error


def _list_tables(
    context: Mapping[str, Any], log: Log, fit: Fit | None, diagnosis: Diagnosis | None
) -> Iterable[tuple[str, list[Row]]]:
    """Yield title and rows of each sheet but that of the samples; the first row is the header."""
    findings = [("Finding", finding.text) for finding in context["findings"]]
    yield "Summary", [("Property", "Value"), *context["run"], *findings, *context["outcome"]]
    yield "Strokes", _make_stroke_rows(log)
    if fit is not None:
        yield "Parameters", _make_parameter_rows(fit)
        yield "Error by drive", _make_error_rows(fit.per_drive)
    if diagnosis is not None:
        yield "Diagnosis", _make_diagnosis_rows(diagnosis)
    yield "Definitions", [("Term", "Unit", "Definition"), *list_definitions()]


def _make_stroke_rows(log: Log) -> list[Row]:
    head = ["Segment", "Motion", "Drive"]
    head += [f"{one.title} [{one.unit}]" if one.unit else one.title for one in QUANTITIES.values()]
    strokes = derive_strokes(log)
    rows: list[Row] = [
        [one.segment.name, one.segment.motion, one.segment.drive, *one.values.values()] for one in strokes
    ]
    return [head, *rows]


def _make_parameter_rows(fit: Fit) -> list[Row]:
    head = ["Form", "Name", "Value", "95 % from", "95 % to", "Unit", "Identifiable", "Note"]
    forms = {"paper": fit.parameters, "regular": fit.coordinates}
    return [head, *(_make_estimate_row(form, *item) for form, values in forms.items() for item in values.items())]


def _make_estimate_row(form: str, name: str, estimate: Estimate) -> Row:
    low, high = estimate.ci95 or (None, None)
    known = "yes" if estimate.identifiable else "no"
    return [form, name, estimate.value, low, high, estimate.unit, known, estimate.note]


def _make_error_rows(errors: Iterable[DriveError]) -> list[Row]:
    rows: list[Row] = [[one.drive, one.unit, one.rmse_n, one.nrmse, one.samples] for one in errors]
    return [["Drive", "Unit", "RMSE [N]", "NRMSE", "Samples"], *rows]


def _make_diagnosis_rows(diagnosis: Diagnosis) -> list[Row]:
    gap = diagnosis.gap
    rows: list[Row] = [
        ["Quantity", "Name", "Value", "95 % from", "95 % to", "Unit"],
        ["verdict", diagnosis.verdict],
        ["force error of the refitted law", "", gap.before_n, None, None, "N"],
        ["force error with the named effects", "", gap.after_n, None, None, "N"],
        ["noise floor", "", gap.noise_floor_n, *(gap.noise_floor_ci95 or (None, None)), "N"],
        ["closed part of the gap", "", gap.shrinkage, *(gap.shrinkage_ci95 or (None, None)), "1"],
        ["probability of the named set", "", diagnosis.probability, None, None, "1"],
    ]
    for effect in diagnosis.effects:
        rows.append([f"probability of {effect.name}", effect.stage, effect.probability, None, None, "1"])
        for name, value in effect.parameters.items():
            rows.append([f"{effect.name}", name, value.value, *(value.ci95 or (None, None)), value.unit])
    return rows


def _write_samples(book: Workbook, log: Log) -> None:
    """Write the raw samples, in several sheets if one has too few rows; a missing value is an empty cell."""
    columns = make_columns(log)
    count = len(next(iter(columns.values())))
    for number, start in enumerate(range(0, count, _MAX_ROWS)):
        rows = slice(start, start + _MAX_ROWS)
        values = np.column_stack([np.asarray(column[rows], float) for column in columns.values()]).tolist()
        cells = ([None if value != value else value for value in row] for row in values)
        _write_sheet(book, f"Samples {number + 1}" if number else "Samples", [list(columns), *cells])


def _write_sheet(book: Workbook, title: str, rows: Iterable[Row]) -> None:
    sheet: Worksheet = book.add_worksheet(title)
    bold = book.add_format({"bold": True})
    sheet.freeze_panes(1, 0)
    sheet.set_column(0, 20, _WIDTH)
    for index, row in enumerate(rows):
        for place, value in enumerate(row):
            _write_cell(sheet, index, place, value, None if index else bold)


def _write_cell(sheet: Worksheet, row: int, column: int, value: str | float | None, style: Any) -> None:
    # Texts never become formulas or links: a specimen may be named "=1+1".
    if isinstance(value, str):
        sheet.write_string(row, column, value, style)
    elif value is not None:
        sheet.write_number(row, column, value, style)

"""Units and senses of other machines: values of a log, and refusals that list what is known."""

import numpy as np
import pytest

from bench.csv_import.csv_file import COLUMN_NAMES, read_csv
from bench.csv_import.importer import import_recordings
from bench.csv_import.units import REVERSIBLE_COLUMNS, UNITS, Conversion, make_conversions
from bench.errors import RecordingError
from bench.log.reader import read_log
from tests.support.logs import csv_columns, write_csv


@pytest.mark.parametrize(
    ("column", "unit", "recorded", "value"),
    [
        ("time_s", "ms", 250.0, 0.25),
        ("time_s", "us", 4e6, 4.0),
        ("displacement_m", "mm", -12.5, -0.0125),
        ("displacement_m", "in", 2.0, 0.0508),
        ("velocity_mps", "mm/s", 300.0, 0.3),
        ("velocity_mps", "in/s", 10.0, 0.254),
        ("force_n", "kN", 1.6, 1600.0),
        ("force_n", "lbf", 100.0, 444.82216152605),
        ("force_n", "kgf", 10.0, 98.0665),
        ("voltage_v", "mV", 500.0, 0.5),
        ("current_a", "mA", 750.0, 0.75),
        ("temperature_c", "degF", 212.0, 100.0),
        ("temperature_c", "K", 293.15, 20.0),
    ],
)
def test_a_value_is_converted_to_the_unit_of_a_log(column, unit, recorded, value):
    found = make_conversions({column: unit}, [])[column].apply(np.array([recorded]))
    assert found == pytest.approx(value, abs=1e-12)


def test_each_column_has_units_and_the_first_is_that_of_a_log():
    assert set(UNITS) == set(COLUMN_NAMES)
    assert all(next(iter(units.values())) == Conversion(1.0) for units in UNITS.values())
    assert set(REVERSIBLE_COLUMNS) < set(COLUMN_NAMES)


def test_a_reversed_column_has_its_unit_and_the_opposite_sense():
    found = make_conversions({"force_n": "kN"}, ["force_n", "displacement_m"])
    assert found["force_n"].apply(np.array([1.5])) == pytest.approx(-1500.0)
    assert found["displacement_m"].apply(np.array([0.01])) == pytest.approx(-0.01)


@pytest.mark.parametrize(
    ("units", "reversed_columns", "refusal"),
    [
        ({"force_n": "stone"}, [], "force_n in stone cannot be imported; units of force_n are N, kN, lbf, kgf"),
        ({"mass": "kg"}, [], "a column mass cannot be imported; columns are time_s, "),
        ({}, ["time_s"], "time_s reversed cannot be imported; columns with a sense are displacement_m, "),
    ],
)
def test_an_unknown_unit_is_refused_with_those_that_are_known(units, reversed_columns, refusal):
    with pytest.raises(RecordingError, match=refusal):
        make_conversions(units, reversed_columns)


def test_a_file_of_another_machine_becomes_the_same_log(tmp_path):
    columns = csv_columns()
    other = columns | {
        "time_s": 1e3 * columns["time_s"],
        "displacement_m": 1e3 * columns["displacement_m"],
        "force_n": -1e-3 * columns["force_n"],
    }
    plain, foreign = write_csv(tmp_path / "a.csv", columns), write_csv(tmp_path / "b.csv", other)
    import_recordings([plain], tmp_path / "a.mcap")
    units = {"time_s": "ms", "displacement_m": "mm", "force_n": "kN"}
    summary = import_recordings([foreign], tmp_path / "b.mcap", units=units, reversed_columns=["force_n"])
    assert "travel" not in summary
    logs = [read_log(tmp_path / name) for name in ("a.mcap", "b.mcap")]
    for channel in ("time", "displacement", "force", "velocity"):
        np.testing.assert_allclose(logs[1].samples[channel], logs[0].samples[channel], rtol=1e-6, atol=1e-9)
    assert [s.name for s in logs[1].segments] == [s.name for s in logs[0].segments]


def test_a_unit_of_a_column_that_the_file_lacks_is_refused(tmp_path):
    path = write_csv(tmp_path / "a.csv", csv_columns())
    with pytest.raises(
        RecordingError, match=r"a\.csv, row 1: no column temperature_c, whose unit or sense was given"
    ):
        read_csv(path, conversions=make_conversions({"temperature_c": "K"}, []))


def test_a_travel_of_metres_is_reported_with_the_option_for_millimetres(tmp_path):
    columns = csv_columns()
    path = write_csv(tmp_path / "a.csv", columns | {"displacement_m": 1e3 * columns["displacement_m"]})
    travel = 1e3 * float(np.ptp(columns["displacement_m"]))
    summary = import_recordings([path], tmp_path / "a.mcap")
    assert f"a: the travel is {travel:.3g} m; if these are mm, import with --unit displacement_m=mm" in summary

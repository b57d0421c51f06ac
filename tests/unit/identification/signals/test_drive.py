"""Drive levels and bins, and the series as a file."""

import json

import numpy as np
import pytest

from identification.documents.force_series import ForceSeries, write_force_series
from identification.errors import IdentificationError
from identification.signals.drive import average_drive_levels, bin_drive, estimate_drive_noise

RANDOM = np.random.default_rng(5)


def test_only_constant_levels_are_averaged():
    true = np.repeat([0.0, 0.3, 0.1], 500)
    noisy = true + 1e-3 * RANDOM.standard_normal(len(true))
    averaged = average_drive_levels(noisy)
    assert np.abs(averaged - true).max() < 2e-4
    assert len(np.unique(averaged)) == 3


@pytest.mark.parametrize("true", [np.repeat([0.0, 0.3, 0.1], 500), np.linspace(0.0, 5.0, 1500)])
def test_the_noise_of_a_drive_is_estimated_despite_steps_and_ramps(true):
    noisy = true + 1e-3 * RANDOM.standard_normal(len(true))
    assert estimate_drive_noise(noisy) == pytest.approx(1e-3, rel=0.1)


def test_a_ramp_stays_as_measured():
    ramp = np.linspace(0, 1, 1000) + 1e-4 * RANDOM.standard_normal(1000)
    np.testing.assert_array_equal(average_drive_levels(ramp), ramp)


def test_exact_levels_stay_exact():
    drive = np.repeat([0.0, 0.5], 300)
    np.testing.assert_array_equal(average_drive_levels(drive), drive)


def test_constant_levels_are_binned_by_value():
    drive = np.repeat([0.0, 0.2, 0.5], 400) + 1e-4 * RANDOM.standard_normal(1200)
    assert [round(value, 2) for value, _ in bin_drive(drive)] == [0.0, 0.2, 0.5]
    assert [len(at) for _, at in bin_drive(drive)] == [400, 400, 400]


def test_a_varying_drive_falls_into_at_most_eight_bins():
    bins = bin_drive(np.linspace(0.0, 2.0, 5000))
    assert len(bins) == 8
    assert sum(len(at) for _, at in bins) == 5000
    assert bins[0][0] == pytest.approx(0.125)


def test_one_drive_is_one_bin():
    assert [(value, len(at)) for value, at in bin_drive(np.full(50, 0.3))] == [(0.3, 50)]


@pytest.fixture
def series():
    n = 20
    ramp = np.arange(n, dtype=float)
    return ForceSeries(
        ramp / 1000, ramp * 1e-3, ramp, np.full(n, 0.5), ramp * 10, ramp * 10 + 1, np.zeros(n, np.int64),
        np.zeros(n, bool), ("one",), "A",
    )  # fmt: skip


def test_a_table_has_units_in_its_header(series, tmp_path):
    write_force_series(tmp_path / "s.csv", series)
    lines = (tmp_path / "s.csv").read_text().splitlines()
    assert lines[0] == "time_s,displacement_m,velocity_mps,force_n,simulated_force_n,current_a"
    assert len(lines) == 21
    assert float(lines[3].split(",")[4]) == 21.0


def test_arrays_contain_names_and_unit(series, tmp_path):
    write_force_series(tmp_path / "s.npz", series)
    with np.load(tmp_path / "s.npz") as file:
        assert json.loads(str(file["info"])) == {"stretches": ["one"], "drive_unit": "A"}
        np.testing.assert_array_equal(file["simulated"], series.simulated)


@pytest.mark.parametrize(("name", "reason"), [("s.xlsx", r"as \.npz or \.csv"), ("no/s.csv", "cannot be written")])
def test_a_series_that_cannot_be_written_is_refused(series, tmp_path, name, reason):
    with pytest.raises(IdentificationError, match=reason):
        write_force_series(tmp_path / name, series)

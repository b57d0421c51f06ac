"""Output files: paths are checked before the computation, documents are written completely or not at all."""

from pathlib import Path

import numpy as np
import pytest

from identification.documents.files import check_output_path, describe_output_path, write_document
from identification.documents.fit import SplitErrors
from identification.documents.force_series import ForceSeries, write_force_series
from identification.errors import IdentificationError

DOCUMENT = SplitErrors(train=1.5, validation=None, held_out=2.0)


def test_an_output_needs_its_folder_and_standard_output_needs_none(tmp_path, monkeypatch):
    check_output_path(tmp_path / "a.json")
    with pytest.raises(IdentificationError, match=r"there is no folder .*missing; choose another place"):
        check_output_path(tmp_path / "missing" / "a.json")
    monkeypatch.chdir(tmp_path)
    check_output_path(Path("-"))
    check_output_path(Path("a.json"))


def test_standard_output_works_where_the_current_folder_is_gone(tmp_path, monkeypatch):
    monkeypatch.setattr(Path, "is_dir", lambda self: False)
    check_output_path(Path("-"))
    with pytest.raises(IdentificationError):
        check_output_path(tmp_path / "a.json")


def test_a_document_is_written_or_printed(tmp_path, capsys):
    write_document(tmp_path / "a.json", DOCUMENT)
    assert SplitErrors.model_validate_json((tmp_path / "a.json").read_bytes()) == DOCUMENT
    assert [path.name for path in tmp_path.iterdir()] == ["a.json"]
    assert capsys.readouterr().out == ""
    write_document(Path("-"), DOCUMENT)
    assert SplitErrors.model_validate_json(capsys.readouterr().out) == DOCUMENT
    assert (describe_output_path(Path("-")), describe_output_path(Path("a.json"))) == ("printed", "a.json")
    with pytest.raises(IdentificationError, match="cannot be written"):
        write_document(tmp_path / "missing" / "a.json", DOCUMENT)


def make_series(unit, band=None):
    n = 3
    channels = [np.arange(n) + 10.0 * k for k in range(6)]
    return ForceSeries(*channels, np.zeros(n, np.int64), np.zeros(n, bool), ("one",), unit, band)


@pytest.mark.parametrize(("unit", "column"), [("V", "voltage_v"), ("A", "current_a")])
def test_a_table_names_the_drive_by_its_unit_and_has_its_band(tmp_path, unit, column):
    write_force_series(tmp_path / "s.csv", make_series(unit, (np.full(3, -7.0), np.full(3, 8.0))))
    head, first, *_ = (tmp_path / "s.csv").read_text().splitlines()
    names = f"time_s,displacement_m,velocity_mps,force_n,simulated_force_n,{column},lower_force_n,upper_force_n"
    assert head == names
    assert first == "0,10,20,40,50,30,-7,8"
    write_force_series(tmp_path / "t.csv", make_series(unit))
    assert (tmp_path / "t.csv").read_text().splitlines()[0] == names.removesuffix(",lower_force_n,upper_force_n")


def test_arrays_have_their_band_only_where_it_is_known(tmp_path):
    write_force_series(tmp_path / "s.npz", make_series("V", (np.full(3, -7.0), np.full(3, 8.0))))
    write_force_series(tmp_path / "t.npz", make_series("V"))
    with np.load(tmp_path / "s.npz") as with_band, np.load(tmp_path / "t.npz") as without:
        assert (with_band["lower"][0], with_band["upper"][0]) == (-7.0, 8.0)
        assert "lower" not in without
        np.testing.assert_array_equal(without["velocity"], [20.0, 21.0, 22.0])
    with pytest.raises(IdentificationError, match=r"\.npz or \.csv"):
        write_force_series(tmp_path / "s.txt", make_series("V"))

import sys

import numpy as np
import pytest
from scipy.io import loadmat

from bench.cli import main
from bench.csv_import.importer import import_recordings
from bench.errors import LogError
from bench.log.export import export_log, make_columns
from bench.log.reader import read_log
from bench.log.writer import LogWriter
from tests.support.logs import csv_columns, header, shared_folder, times, values, write_csv, write_log


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "run.mcap"
    write_log(path)
    return read_log(path)


def test_every_column_name_contains_its_unit(log):
    assert list(make_columns(log)) == [
        "time_s",
        "displacement_m",
        "velocity_smoothed_mps",
        "force_n",
        "voltage_v",
        "segment",
    ]


def test_drive_in_amperes_is_a_current(tmp_path):
    write_log(tmp_path / "run.mcap", drive_kind="coil_a", drive_unit="A")

    assert "current_a" in make_columns(read_log(tmp_path / "run.mcap"))


def test_csv_can_be_imported_again_without_losing_a_bit(tmp_path):
    import_recordings([write_csv(tmp_path / "a.csv", csv_columns())], tmp_path / "first.mcap")
    first = read_log(tmp_path / "first.mcap")

    export_log(first, "csv", tmp_path / "b.csv")
    import_recordings([tmp_path / "b.csv"], tmp_path / "second.mcap")
    second = read_log(tmp_path / "second.mcap")

    for name in ("time_ns", "displacement", "velocity", "force", "coil_drive", "segment"):
        np.testing.assert_array_equal(second.samples[name], first.samples[name])
    assert [s.name for s in second.segments] == [s.name for s in first.segments]


def test_real_recording_is_unchanged_by_import_and_export(tmp_path):
    source = shared_folder() / "data" / "utfsm_sine" / "2mm_5Hz_0A.csv.gz"
    import_recordings([source], tmp_path / "run.mcap")
    export_log(read_log(tmp_path / "run.mcap"), "csv", tmp_path / "run.csv")

    given = np.genfromtxt(source, delimiter=",", names=True)
    back = np.genfromtxt(tmp_path / "run.csv", delimiter=",", names=True)

    np.testing.assert_array_equal(back["force_n"], given["force_n"])
    np.testing.assert_array_equal(back["displacement_m"], given["displacement_m"])


def test_csv_cell_of_a_missing_value_is_empty(tmp_path):
    with LogWriter(tmp_path / "run.mcap", header()) as writer:
        writer.write_samples(times(2), values(2, temperature=[np.nan, 21.5], segment=[-1, 0]))

    export_log(read_log(tmp_path / "run.mcap"), "csv", tmp_path / "run.csv")

    rows = (tmp_path / "run.csv").read_text().splitlines()
    assert rows[0].endswith("voltage_v,temperature_c,segment")
    assert rows[1].endswith(",0.2,,")
    assert rows[2].endswith(",0.2,21.5,0")


def test_mat_file_contains_every_column(log, tmp_path):
    export_log(log, "mat", tmp_path / "run.mat")

    table = loadmat(tmp_path / "run.mat")
    np.testing.assert_array_equal(table["force_n"][:, 0], log.samples["force"])


def test_parquet_file_contains_every_column(log, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")
    export_log(log, "parquet", tmp_path / "run.parquet")

    table = parquet.read_table(tmp_path / "run.parquet")
    assert table.column_names == list(make_columns(log))
    np.testing.assert_array_equal(table["force_n"].to_numpy(), log.samples["force"])


def test_message_on_missing_pyarrow_names_the_extra(log, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)

    with pytest.raises(LogError, match=r"pip install 'mrbench\[export\]'"):
        export_log(log, "parquet", tmp_path / "run.parquet")
    assert list(tmp_path.iterdir()) == []


def test_export_into_a_missing_folder_is_refused(log, tmp_path):
    with pytest.raises(LogError, match="does not exist; create it first"):
        export_log(log, "csv", tmp_path / "nowhere" / "run.csv")


def run_command(*words):
    with pytest.raises(SystemExit) as ending:
        main(["export", *map(str, words)])
    return ending.value.code


def test_command_writes_next_to_the_log(tmp_path):
    write_log(tmp_path / "run.mcap")

    assert run_command(tmp_path / "run.mcap", "--format", "csv") == 0
    assert (tmp_path / "run.csv").read_text().startswith("time_s,")


def test_unknown_format_is_misuse(tmp_path, capsys):
    assert run_command(tmp_path / "run.mcap", "--format", "xls") == 2
    assert "not one of csv, parquet, mat" in capsys.readouterr().err

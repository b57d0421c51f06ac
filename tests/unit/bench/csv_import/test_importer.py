import gzip

import numpy as np
import pytest

from bench.cli import main
from bench.csv_import.csv_file import read_csv
from bench.csv_import.importer import import_recordings
from bench.errors import RecordingError
from bench.log.reader import read_log
from tests.support.logs import csv_columns, shared_folder, write_csv, write_log, write_spoilt_csv


def import_and_read(folder, *files, **options):
    import_recordings(files, folder / "run.mcap", **options)
    return read_log(folder / "run.mcap")


def rename(columns, **names):
    return {names.get(name, name): column for name, column in columns.items()}


def test_values_are_those_of_the_file(tmp_path):
    columns = csv_columns()

    samples = import_and_read(tmp_path, write_csv(tmp_path / "a.csv", columns)).samples

    np.testing.assert_array_equal(samples["force"], columns["force_n"])
    np.testing.assert_array_equal(samples["displacement"], columns["displacement_m"])
    np.testing.assert_allclose(samples["time"], columns["time_s"], atol=1e-9)


def test_compressed_file_is_read_like_a_plain_one(tmp_path):
    plain = write_csv(tmp_path / "a.csv", csv_columns())
    packed = tmp_path / "b.csv.gz"
    packed.write_bytes(gzip.compress(plain.read_bytes()))

    assert read_csv(packed).name == "b"
    np.testing.assert_array_equal(read_csv(packed).force, read_csv(plain).force)


def test_files_are_one_second_apart_and_keep_their_names(tmp_path):
    files = [write_csv(tmp_path / f"{name}.csv", csv_columns(500)) for name in ("first", "second")]

    log = import_and_read(tmp_path, *files)

    assert [segment.stretch for segment in log.segments] == ["first", "first", "second", "second"]
    assert log.samples["time"][500] - log.samples["time"][499] == pytest.approx(1.0)


def test_files_with_the_same_name_get_different_stretch_names(tmp_path):
    files = []
    for folder in ("monday", "tuesday"):
        (tmp_path / folder).mkdir()
        files.append(write_csv(tmp_path / folder / "run.csv", csv_columns(500)))

    assert {segment.stretch for segment in import_and_read(tmp_path, *files).segments} == {"run", "run_2"}


def test_files_keep_their_sampling_rates(tmp_path):
    slow = csv_columns(500)
    slow["time_s"] = slow["time_s"] * 5
    files = [write_csv(tmp_path / "fast.csv", csv_columns(500)), write_csv(tmp_path / "slow.csv", slow)]

    steps = np.diff(import_and_read(tmp_path, *files).samples["time"])

    assert steps[10] == pytest.approx(0.002)
    assert steps[-10] == pytest.approx(0.010)


def test_segments_are_found_and_written(tmp_path):
    log = import_and_read(tmp_path, write_csv(tmp_path / "a.csv", csv_columns(2000)))

    assert [segment.name for segment in log.segments] == ["10mm_1Hz_0.2V", "10mm_1Hz_0.4V"]
    assert log.samples["segment"][999] == 0
    assert log.samples["segment"][1000] == 1


def test_the_default_drive_kind_of_volts_is_a_driver_command(tmp_path):
    run = import_and_read(tmp_path, write_csv(tmp_path / "a.csv", csv_columns())).metadata["run"]

    assert (run["drive_kind"], run["drive_unit"], run["source"]) == ("driver_command_v", "V", "import")


def test_the_default_drive_kind_of_amperes_is_the_coil_current(tmp_path):
    path = write_csv(tmp_path / "a.csv", rename(csv_columns(), voltage_v="current_a"))

    run = import_and_read(tmp_path, path).metadata["run"]

    assert (run["drive_kind"], run["drive_unit"]) == ("coil_a", "A")


def test_drive_kind_and_specimen_can_be_given(tmp_path):
    path = write_csv(tmp_path / "a.csv", csv_columns())

    run = import_and_read(tmp_path, path, drive_kind="coil_v", specimen="damper 12").metadata["run"]

    assert (run["drive_kind"], run["specimen"]) == ("coil_v", "damper 12")


def test_velocity_of_the_file_is_kept(tmp_path):
    velocity = np.linspace(-1, 1, 1000)

    log = import_and_read(tmp_path, write_csv(tmp_path / "a.csv", {**csv_columns(), "velocity_mps": velocity}))

    np.testing.assert_array_equal(log.samples["velocity"], velocity)
    assert log.metadata["units"]["velocity_from"] == "measured"


def test_velocity_is_computed_for_all_files_if_one_has_none(tmp_path):
    with_ = write_csv(tmp_path / "a.csv", {**csv_columns(), "velocity_mps": np.ones(1000)})
    without = write_csv(tmp_path / "b.csv", csv_columns())

    summary = import_recordings([with_, without], tmp_path / "run.mcap")

    assert "velocity computed from displacement" in summary
    assert read_log(tmp_path / "run.mcap").metadata["units"]["velocity_from"] == "smoothed displacement"


def test_temperature_of_the_file_is_kept(tmp_path):
    log = import_and_read(
        tmp_path, write_csv(tmp_path / "a.csv", {**csv_columns(), "temperature_c": np.full(1000, 23.5)})
    )

    assert set(log.samples["temperature"]) == {23.5}


def test_uneven_sampling_is_noted(tmp_path):
    columns = csv_columns()
    columns["time_s"] = columns["time_s"] + np.where(np.arange(1000) >= 700, 0.3, 0.0)

    assert "a: time steps from 0.002 to 0.302 s" in import_recordings(
        [write_csv(tmp_path / "a.csv", columns)], tmp_path / "run.mcap"
    )


def test_headers_of_the_file_can_be_mapped(tmp_path):
    path = write_csv(tmp_path / "a.csv", rename(csv_columns(), force_n="Load (N)"))

    assert len(read_csv(path, {"force_n": "Load (N)"}).force) == 1000


def test_extra_columns_quotes_blank_lines_and_a_byte_order_mark_are_accepted(tmp_path):
    path = write_csv(tmp_path / "a.csv", csv_columns())
    header, *rows = path.read_text().splitlines()
    rows = [f'{row},"left, right"' for row in rows]
    path.write_text("\n".join(["\ufeff" + header.replace(",", " , ") + ",remark", *rows[:5], "", *rows[5:], ""]))

    assert len(read_csv(path).force) == 1000


def test_file_with_both_drives_needs_a_drive_kind(tmp_path):
    path = write_csv(tmp_path / "a.csv", {**csv_columns(), "current_a": np.ones(1000)})

    with pytest.raises(RecordingError, match=r"a\.csv, row 1: both voltage_v and current_a; .*--drive-kind"):
        read_csv(path)
    assert read_csv(path, drive_kind="coil_a").drive_unit == "A"


@pytest.mark.parametrize(
    ("line", "column", "text", "message"),
    [
        (902, "force_n", "abc", "row 902, column force_n: 'abc' is not a number"),
        (902, "force_n", "nan", "row 902, column force_n: nan is not a finite number"),
        (3, "voltage_v", "inf", "row 3, column voltage_v: inf is not a finite number"),
        (501, "displacement_m", "", "row 501, column displacement_m: the cell is empty"),
        (501, "displacement_m", "1_000", "row 501, column displacement_m: '1_000' is not a number"),
        (700, "time_s", "1.0", "row 700, column time_s: 1 s after 1.394 s; time must increase"),
    ],
)
def test_bad_cell_is_named_by_file_row_and_column(tmp_path, line, column, text, message):
    with pytest.raises(RecordingError) as error:
        read_csv(write_spoilt_csv(tmp_path / "bad.csv", line, column, text))

    assert str(error.value).startswith("bad.csv, row ")
    assert message in str(error.value)


def test_row_number_counts_blank_lines(tmp_path):
    path = write_spoilt_csv(tmp_path / "bad.csv", 10, "force_n", "abc")
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines[:4], "", "", *lines[4:]]))

    with pytest.raises(RecordingError, match="row 12, column force_n"):
        read_csv(path)


def test_row_that_ends_early_is_named(tmp_path):
    path = write_csv(tmp_path / "bad.csv", csv_columns())
    lines = path.read_text().splitlines()
    lines[49] = lines[49].rsplit(",", 1)[0]
    path.write_text("\n".join(lines))

    with pytest.raises(RecordingError, match="row 50, column force_n: the row ends after 3 cells"):
        read_csv(path)


@pytest.mark.parametrize("missing", ["time_s", "displacement_m", "force_n"])
def test_message_on_a_missing_column_explains_how_to_map_it(tmp_path, missing):
    path = write_csv(tmp_path / "bad.csv", rename(csv_columns(), **{missing: "load"}))

    with pytest.raises(RecordingError, match=rf"bad\.csv, row 1: no column {missing};.*--column {missing}=HEADER"):
        read_csv(path)


def test_message_on_a_missing_drive_names_both_columns(tmp_path):
    path = write_csv(tmp_path / "bad.csv", rename(csv_columns(), voltage_v="signal"))

    with pytest.raises(RecordingError, match=r"no column voltage_v or current_a;.*--column voltage_v=HEADER"):
        read_csv(path)


def test_missing_mapped_header_is_named(tmp_path):
    path = write_csv(tmp_path / "bad.csv", csv_columns())

    with pytest.raises(RecordingError, match="no column Oil temp"):
        read_csv(path, {"temperature_c": "Oil temp"})


def test_repeated_column_is_refused(tmp_path):
    path = write_csv(tmp_path / "bad.csv", csv_columns())
    path.write_text(path.read_text().replace("voltage_v", "voltage_v,force_n", 1))

    with pytest.raises(RecordingError, match="force_n appears twice"):
        read_csv(path)


@pytest.mark.parametrize(("samples", "message"), [(199, "row 200: 199 samples"), (0, "0 samples")])
def test_too_few_samples_are_refused(tmp_path, samples, message):
    with pytest.raises(RecordingError, match=f"{message}, fewer than 200"):
        read_csv(write_csv(tmp_path / "bad.csv", {name: c[:samples] for name, c in csv_columns().items()}))


@pytest.mark.parametrize("data", [b"", b"\n\n"])
def test_empty_file_is_refused(tmp_path, data):
    (tmp_path / "bad.csv").write_bytes(data)

    with pytest.raises(RecordingError, match=r"bad\.csv, row 1: no header"):
        read_csv(tmp_path / "bad.csv")


def test_file_that_is_not_text_is_refused(tmp_path):
    (tmp_path / "bad.csv").write_bytes(b"time_s\n\xff\xfe\x00")

    with pytest.raises(RecordingError, match=r"bad\.csv, row 2: not UTF-8 text"):
        read_csv(tmp_path / "bad.csv")


def test_damaged_gzip_file_is_refused(tmp_path):
    (tmp_path / "bad.csv.gz").write_bytes(gzip.compress(b"time_s\n" * 1000)[:-20])

    with pytest.raises(RecordingError, match="gzip file is damaged"):
        read_csv(tmp_path / "bad.csv.gz")


def test_missing_file_is_named(tmp_path):
    with pytest.raises(RecordingError, match=r"none\.csv: no such file"):
        read_csv(tmp_path / "none.csv")


def test_voltage_and_current_in_one_log_are_refused(tmp_path):
    volts = write_csv(tmp_path / "volts.csv", csv_columns())
    ampere = write_csv(tmp_path / "ampere.csv", rename(csv_columns(), voltage_v="current_a"))

    with pytest.raises(RecordingError, match=r"ampere\.csv, row 1: the drive is in A, in volts\.csv in V"):
        import_and_read(tmp_path, volts, ampere)


def test_drive_kind_with_another_unit_is_refused(tmp_path):
    with pytest.raises(RecordingError, match="the drive is in V, but coil_a is in A"):
        import_and_read(tmp_path, write_csv(tmp_path / "a.csv", csv_columns()), drive_kind="coil_a")


def run_command(*words):
    with pytest.raises(SystemExit) as ending:
        main(["import", *map(str, words)])
    return ending.value.code


def test_command_writes_a_log(tmp_path, capsys):
    path = write_csv(tmp_path / "a.csv", rename(csv_columns(), force_n="load"))

    assert run_command(path, "--out", tmp_path / "run.mcap", "--column", "force_n=load") == 0
    assert "1000 samples in one stretch and 2 segments" in capsys.readouterr().err


def test_command_keeps_the_existing_log_if_a_file_is_refused(tmp_path, capsys):
    good = write_csv(tmp_path / "good.csv", csv_columns())
    bad = write_spoilt_csv(tmp_path / "bad.csv", 902, "force_n", "abc")
    write_log(tmp_path / "run.mcap")
    before = (tmp_path / "run.mcap").read_bytes()

    assert run_command(good, bad, "--out", tmp_path / "run.mcap") == 1
    message = capsys.readouterr().err
    assert message == "mrbench: bad.csv, row 902, column force_n: 'abc' is not a number\n"
    assert (tmp_path / "run.mcap").read_bytes() == before
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["bad.csv", "good.csv", "run.mcap"]


def test_command_reports_a_missing_folder(tmp_path, capsys):
    path = write_csv(tmp_path / "a.csv", csv_columns())

    assert run_command(path, "--out", tmp_path / "nowhere" / "run.mcap") == 1
    assert "does not exist; create it first" in capsys.readouterr().err


def test_failure_while_writing_leaves_no_file(tmp_path, monkeypatch):
    def fails(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("bench.csv_import.importer.write_stretch", fails)

    with pytest.raises(Exception, match="no space left on device"):
        import_and_read(tmp_path, write_csv(tmp_path / "a.csv", csv_columns()))
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.csv"]


@pytest.mark.parametrize("words", [["--column", "load"], ["--column", "load=force"], ["--drive-kind", "amps"]])
def test_misuse_of_the_command_ends_with_2(tmp_path, capsys, words):
    path = write_csv(tmp_path / "a.csv", csv_columns())

    assert run_command(path, "--out", tmp_path / "run.mcap", *words) == 2
    assert "is not" in capsys.readouterr().err


def test_real_recordings_are_imported_completely(tmp_path):
    files = sorted((shared_folder() / "data" / "utfsm_sine").glob("10mm_2Hz_*.csv.gz"))

    log = import_and_read(tmp_path, *files)

    assert len({segment.stretch for segment in log.segments}) == len(files) == 5
    np.testing.assert_array_equal(log.samples["force"][: len(read_csv(files[0]).force)], read_csv(files[0]).force)


def test_stamps_with_too_few_digits_are_replaced_and_named(tmp_path):
    columns = csv_columns()
    rounded = {**columns, "time_s": np.round(columns["time_s"], 2)}
    assert (np.diff(rounded["time_s"]) == 0).any()

    text = import_recordings([write_csv(tmp_path / "a.csv", rounded)], tmp_path / "run.mcap")

    steps = np.diff(read_log(tmp_path / "run.mcap").samples["time"])
    np.testing.assert_allclose(steps, np.mean(np.diff(columns["time_s"])), rtol=1e-3)
    assert "a: the time stamps are rounded to 0.01 s; the samples are taken as uniform" in text


@pytest.mark.parametrize("delimiter", [";", "\t"])
def test_other_delimiters_and_decimal_commas_give_the_same_values(tmp_path, delimiter):
    plain = write_csv(tmp_path / "a.csv", rename(csv_columns(), force_n="Force, axial"))
    text = plain.read_text().replace('"Force, axial"', "Force, axial")
    header, body = text.split("\n", 1)
    header = header.replace(",", delimiter).replace(f"Force{delimiter} axial", "Force, axial")
    body = body.replace(",", delimiter).replace(".", ",")
    other = tmp_path / "b.csv"
    other.write_text(f"{header}\n{body}")

    read = read_csv(other, {"force_n": "Force, axial"})

    np.testing.assert_array_equal(read.force, csv_columns()["force_n"])
    np.testing.assert_allclose(read.displacement, csv_columns()["displacement_m"], rtol=1e-9)

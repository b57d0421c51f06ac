"""Checks in the catalogue: from the log to the record, the chart, and the begin of a new baseline."""

from datetime import timedelta

import pytest

from bench.catalogue import Catalogue, open_database, scan_logs
from bench.catalogue.trash import move_to_trash, restore_from_trash
from bench.checks import CheckSeries
from tests.support.checks import IN_CONTROL, MOUNTED, START, write_check_log, write_shunt_log

FORCE = CheckSeries(check="zero", channel="force", specimen=MOUNTED)


@pytest.fixture
def catalogue(tmp_path, catalogue_url):
    catalogue = Catalogue(open_database(catalogue_url), tmp_path)
    yield catalogue
    catalogue.close()


def scan(catalogue, zeros, first_day=0):
    """Catalogue one check per day with these zeros [N]."""
    for index, zero in enumerate(zeros, start=first_day):
        write_check_log(catalogue.folder / f"check-{index}.mcap", f"check-{index}", zero, index, seed=index)
    scan_logs(catalogue, lambda path: False)


def test_the_log_of_a_check_gives_records_and_a_chart(catalogue):
    scan(catalogue, [1.0, 2.0])
    records = catalogue.checks.list_newest(10, "force")
    assert [one.run for one in records] == ["check-1", "check-0"]
    assert records[0].value == pytest.approx(2.0, abs=0.35)
    assert records[0].measured == START + timedelta(days=1, seconds=1)
    chart = catalogue.checks.make_chart(FORCE)
    assert (chart.state, chart.count, [one.run for one in chart.points]) == (
        "not_enough",
        2,
        ["check-0", "check-1"],
    )
    assert len(catalogue.checks.list_newest(10)) == 6


def test_a_planted_zero_shift_of_the_load_cell_is_out_of_control(catalogue):
    scan(catalogue, [*IN_CONTROL, 0.0])
    assert {one.channel: one.state for one in catalogue.checks.list_latest()}["force"] == "in_control"
    scan(catalogue, [12.0], first_day=21)
    latest = {one.channel: one for one in catalogue.checks.list_latest()}
    assert (latest["force"].state, latest["force"].run) == ("out_of_control", "check-21")
    assert "above the limit" in latest["force"].text
    assert latest["displacement"].state == "in_control"


def test_after_a_repair_only_later_checks_count(catalogue):
    scan(catalogue, [*IN_CONTROL, 12.0])
    catalogue.checks.begin_baseline(FORCE, "user:mcurie", "load cell was replaced")
    assert catalogue.checks.make_chart(FORCE).state == "not_enough"
    assert catalogue.checks.make_chart(FORCE).count == 0
    assert {one.channel for one in catalogue.checks.list_latest()} == {"displacement", "coil_voltage"}
    row = catalogue.checks.find_baseline(FORCE)
    assert (row.author, row.reason) == ("user:mcurie", "load cell was replaced")
    assert len(catalogue.checks.list_newest(100, "force")) == 21


def test_checks_with_another_specimen_are_not_compared(catalogue):
    scan(catalogue, [1.0])
    other = FORCE.model_copy(update={"specimen": "S-2"})
    assert catalogue.checks.make_chart(other).points == ()


def test_a_check_in_the_trash_does_not_count(catalogue):
    scan(catalogue, [1.0, 2.0])
    row = move_to_trash(catalogue, catalogue.get_run("check-1"))
    assert [one.run for one in catalogue.checks.make_chart(FORCE).points] == ["check-0"]
    restore_from_trash(catalogue, row)
    assert len(catalogue.checks.make_chart(FORCE).points) == 2


def test_a_run_of_another_method_has_no_record(catalogue):
    path = write_check_log(catalogue.folder / "check-0.mcap", "check-0", method="quick")
    scan_logs(catalogue, lambda path: False)
    assert path.is_file()
    assert catalogue.checks.list_newest(10) == []


def test_shunt_checks_have_a_series_of_their_own(catalogue):
    scan(catalogue, [1.0, 2.0])
    for index in range(2):
        write_shunt_log(
            catalogue.folder / f"shunt-{index}.mcap", f"shunt-{index}", 1000.0 + index, 5 + index, index
        )
    scan_logs(catalogue, lambda path: False)
    shunt = FORCE.model_copy(update={"check": "shunt"})
    assert [one.run for one in catalogue.checks.make_chart(FORCE).points] == ["check-0", "check-1"]
    assert [one.run for one in catalogue.checks.make_chart(shunt).points] == ["shunt-0", "shunt-1"]
    assert [one.value for one in catalogue.checks.list_newest(9, check="shunt")] == pytest.approx(
        [1001.0, 1000.0], abs=0.5
    )
    assert catalogue.checks.find_latest("force").run == "check-1"
    assert catalogue.checks.find_series("force", None, check="shunt") == shunt
    assert [one.series for one in catalogue.checks.make_latest_charts(check="shunt")] == [shunt]
    assert {one.series.check for one in catalogue.checks.make_latest_charts()} == {"zero"}
    latest = {(one.channel, one.check): one.run for one in catalogue.checks.list_latest()}
    assert (latest["force", "zero"], latest["force", "shunt"]) == ("check-1", "shunt-1")
    assert len(latest) == 4


def test_a_new_baseline_of_the_shunt_leaves_the_zero(catalogue):
    scan(catalogue, [1.0])
    write_shunt_log(catalogue.folder / "shunt-0.mcap", "shunt-0")
    scan_logs(catalogue, lambda path: False)
    shunt = FORCE.model_copy(update={"check": "shunt"})
    catalogue.checks.begin_baseline(shunt, "user:mcurie", "amplifier was replaced")
    assert catalogue.checks.make_chart(shunt).count == 0
    assert catalogue.checks.make_chart(FORCE).count == 1
    assert catalogue.checks.find_baseline(FORCE) is None


def test_a_gain_shift_is_out_of_control(catalogue):
    """A gain error of 1 % changes the shunt of 1000 N by 10 N."""
    for index in range(21):
        shunt_n = 1010.0 if index == 20 else 1000.0 + (-1) ** index
        write_shunt_log(catalogue.folder / f"shunt-{index}.mcap", f"shunt-{index}", shunt_n, index, index)
    scan_logs(catalogue, lambda path: False)
    (latest,) = catalogue.checks.list_latest()
    assert (latest.check, latest.state, latest.run) == ("shunt", "out_of_control", "shunt-20")
    assert latest.text.startswith("force: shunt check of 2026-01-25")

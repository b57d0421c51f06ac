"""`mrbench check`: checks in the catalogue of a data folder, and in a log."""

import pytest
from typer import BadParameter

from bench.catalogue import open_catalogue, scan_logs
from bench.catalogue.errors import CatalogueError
from bench.commands.check import check
from bench.commands.check.actions import CheckError
from bench.commands.check.dispatch import Action
from tests.support.checks import MOUNTED, write_check_log


@pytest.fixture
def data(tmp_path):
    data = tmp_path / "runs"
    with open_catalogue(data, is_created=True) as catalogue:
        write_check_log(data / "check-0.mcap", "check-0", 8.0)
        scan_logs(catalogue, lambda path: False)
    return data


def test_checks_are_listed_with_units(data, capsys):
    check(Action.LIST, "force", data=data)
    line = capsys.readouterr().out.strip()
    assert line.startswith("2026-01-05 08:00 UTC force: ")
    assert " N with standard uncertainty 0.0" in line
    assert line.endswith(f"specimen {MOUNTED}, run check-0")
    check(Action.LIST, data=data)
    assert len(capsys.readouterr().out.splitlines()) == 3


def test_the_check_in_a_log_is_the_same_as_in_the_catalogue(data, capsys):
    check(Action.LIST, data=data)
    listed = capsys.readouterr().out
    check(Action.SHOW, str(data / "check-0.mcap"))
    assert sorted(capsys.readouterr().out.splitlines()) == sorted(listed.splitlines())


def test_a_log_of_another_method_is_refused(tmp_path):
    path = write_check_log(tmp_path / "a.mcap", method="quick")
    with pytest.raises(CheckError, match="not the log of a completed check"):
        check(Action.SHOW, str(path))


def test_charts_say_how_many_checks_are_missing(data, capsys):
    check(Action.CHART, data=data)
    assert "force: zero check: not enough checks, 1 of 20" in capsys.readouterr().out.splitlines()
    check(Action.CHART, "force", data=data)
    state, point = capsys.readouterr().out.splitlines()
    assert state == "force: zero check: not enough checks, 1 of 20"
    assert point.startswith("2026-01-05 08:00 UTC ")
    assert point.endswith(" N, baseline")


def test_a_new_baseline_is_stored_with_person_and_reason(data, capsys):
    check(Action.BASELINE, "force", reason="cell was replaced", data=data, operator="M. Curie")
    assert "only checks from now on count" in capsys.readouterr().out
    check(Action.CHART, "force", data=data, specimen=MOUNTED)
    assert capsys.readouterr().out.strip() == "force: no zero check yet"


def test_a_list_needs_a_catalogue_and_a_known_channel(tmp_path, data):
    with pytest.raises(CatalogueError, match="there is no catalogue"):
        check(Action.LIST, data=tmp_path / "none")
    with pytest.raises(CheckError, match="there is no channel 'velocity'; give one of displacement, force"):
        check(Action.CHART, "velocity", data=data)


@pytest.mark.parametrize("words", [(Action.BASELINE,), (Action.SHOW,), (Action.BASELINE, "force")])
def test_misuse_is_refused(words, tmp_path):
    with pytest.raises(BadParameter):
        check(*words, data=tmp_path)


def test_only_a_baseline_takes_a_reason(tmp_path):
    with pytest.raises(BadParameter):
        check(Action.LIST, reason="x", data=tmp_path)

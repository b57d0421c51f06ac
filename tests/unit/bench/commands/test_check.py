"""`mrbench check`: checks in the catalogue of a data folder, and in a log."""

import pytest
from typer import BadParameter

from bench.catalogue import open_catalogue, scan_logs
from bench.catalogue.errors import CatalogueError
from bench.commands.check import check
from bench.commands.check.actions import CheckError
from bench.commands.check.dispatch import Action, Kind
from tests.support.checks import MOUNTED, write_check_log, write_shunt_log


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


@pytest.fixture
def shunted(data):
    """Return a data folder with a zero check and a later shunt check."""
    with open_catalogue(data) as catalogue:
        write_shunt_log(data / "shunt-0.mcap", "shunt-0", day=1)
        scan_logs(catalogue, lambda path: False)
    return data


def test_shunt_checks_are_shown_by_their_name(shunted, capsys):
    check(Action.LIST, data=shunted, kind=Kind.SHUNT)
    listed = capsys.readouterr().out
    assert listed.startswith("2026-01-06 08:00 UTC force, shunt check: ")
    assert listed.count("\n") == 1
    check(Action.SHOW, str(shunted / "shunt-0.mcap"))
    assert capsys.readouterr().out == listed
    check(Action.LIST, data=shunted)
    assert "shunt" not in capsys.readouterr().out
    check(Action.CHART, data=shunted, kind=Kind.SHUNT)
    assert capsys.readouterr().out == "force: shunt check: not enough checks, 1 of 20\n"


def test_a_new_baseline_of_shunt_checks_leaves_zero_checks(shunted, capsys):
    check(Action.BASELINE, "force", kind=Kind.SHUNT, reason="amplifier was replaced", data=shunted)
    assert capsys.readouterr().out.startswith("force, shunt check: only checks from now on count")
    check(Action.CHART, "force", kind=Kind.SHUNT, data=shunted, specimen=MOUNTED)
    assert capsys.readouterr().out.strip() == "force: no shunt check yet"
    check(Action.CHART, "force", data=shunted)
    assert capsys.readouterr().out.startswith("force: zero check: not enough checks, 1 of 20")

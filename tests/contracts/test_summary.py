"""Last line of the summary of several test runs."""

import sys

import pytest

from tests import summary

CASE = '<testcase classname="{}" name="{}">{}</testcase>'


def results(folder, name, *cases):
    path = folder / name
    body = "".join(CASE.format("tests.unit", test, f"<{outcome}/>" if outcome else "") for test, outcome in cases)
    path.write_text(f'<testsuites><testsuite time="1.5">{body}</testsuite></testsuites>')
    return path


def summarise(monkeypatch, capsys, *words):
    monkeypatch.setattr(sys, "argv", ["summary", *map(str, words)])
    code = summary.main()
    return code, capsys.readouterr().out.splitlines()


def test_the_last_result_of_a_repeated_test_counts(tmp_path, monkeypatch, capsys):
    first = results(tmp_path, "a.xml", ("one", ""), ("two", "failure"))
    again = results(tmp_path, "b.xml", ("two", ""))
    assert summarise(monkeypatch, capsys, first)[0] == 1
    code, lines = summarise(monkeypatch, capsys, first, again)
    assert code == 0
    assert lines == [
        "passed only when repeated alone:",
        "  tests.unit::two",
        "==== 0 failed, 2 passed, 0 skipped, 0 deselected in 3.00s ====",
    ]


@pytest.mark.parametrize("outcome", ["skipped", "error", "failure"])
def test_one_test_without_success_fails_the_summary(tmp_path, monkeypatch, capsys, outcome):
    code, _ = summarise(monkeypatch, capsys, results(tmp_path, "a.xml", ("one", ""), ("two", outcome)))
    assert code == 1


def test_a_run_without_results_is_a_failure(tmp_path, monkeypatch, capsys):
    assert summarise(monkeypatch, capsys, results(tmp_path, "a.xml"))[0] == 1


def test_deselected_tests_are_listed_and_counted(tmp_path, monkeypatch, capsys):
    listing = tmp_path / "slow.txt"
    listing.write_text("tests/unit/test_a.py::test_long\n\n1/900 tests collected\n")
    monkeypatch.setattr(
        sys, "argv", ["summary", str(results(tmp_path, "a.xml", ("one", ""))), "--deselected", str(listing)]
    )
    assert summary.main() == 0
    shown = capsys.readouterr().out
    assert "  tests/unit/test_a.py::test_long\n" in shown
    assert "1 deselected" in shown

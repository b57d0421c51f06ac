"""Progress by stages, as JSON lines for a program that started a command."""

import json

from identification.fitting import OptimiserSettings
from identification.pipeline import FitRequest, identify
from identification.progress import LineWriter, StageProgress, advance, enter_stage, ignore_progress, show_progress
from tests.support.short_fit import recording


def test_stages_are_equal_shares_and_an_advanced_stage_is_further(capsys):
    reports = []
    whole = StageProgress(lambda *report: reports.append(report))
    second = enter_stage(whole, "search", 1, 4)
    advance(second, 0.5)("gas_spring", 3.14159)
    advance(second, 7.0)("search", 2.0)
    assert reports == [
        ("search", 0.25, ""),
        ("search", 0.375, "gas_spring, force error 3.14 N"),
        ("search", 0.5, "force error 2 N"),
    ]


def test_any_other_callback_has_no_stages():
    assert enter_stage(ignore_progress, "search", 1, 4) is ignore_progress
    assert advance(ignore_progress, 0.5) is ignore_progress


def test_lines_are_written_where_the_environment_asks_for_them(capsys, monkeypatch):
    monkeypatch.setenv("MRBENCH_PROGRESS", "json")
    with show_progress("identify") as progress:
        enter_stage(progress, "refine", 1, 2)
    lines = [json.loads(line) for line in capsys.readouterr().err.splitlines()]
    assert lines == [
        {"stage": "read", "fraction": 0.0, "message": ""},
        {"stage": "refine", "fraction": 0.5, "message": ""},
    ]


def test_a_pipe_stays_silent_otherwise(capsys, monkeypatch):
    monkeypatch.delenv("MRBENCH_PROGRESS", raising=False)
    with show_progress("identify") as progress:
        progress("refine", 2.0)
    assert capsys.readouterr().err == ""


def test_of_many_reports_of_a_stage_few_are_written(capsys):
    writer = LineWriter()
    for _ in range(1000):
        writer.write("refine", 0.5, "")
    assert 1 <= len(capsys.readouterr().err.splitlines()) < 100


def test_an_identification_reports_its_stages_in_order():
    reports = []
    request = FitRequest(settings=OptimiserSettings(), stages=("refine",))
    identify([recording()], request, StageProgress(lambda *report: reports.append(report)))
    assert next(stage for stage, _, _ in reports) == "refine"
    assert {fraction for _, fraction, _ in reports} == {0.5}

import json
from datetime import UTC, datetime

import numpy as np
import pytest

from bench.errors import ReportError
from bench.report import diagnosis_plots, page
from bench.report.diagnosis import make_context, read_diagnosis
from tests.support.reports import write_log
from tests.support.result_documents import STAGES, diagnosis_document, discovery_document


@pytest.fixture
def written(tmp_path):
    def write(**changes):
        path = tmp_path / "diagnosis.json"
        path.write_text(json.dumps(diagnosis_document(**changes)))
        return path

    return write


@pytest.fixture
def discovery():
    return discovery_document()


def test_the_page_names_the_effect_its_size_and_the_alternatives(written, tmp_path):
    log = write_log(tmp_path / "strokes.mcap")
    report = page.gather(log, None, written())
    drawn = page.make_figures(report)
    assert {"gap", "where"} <= drawn.keys()
    text = page.render(report, drawn, "mrbench report", datetime(2026, 5, 4, tzinfo=UTC))
    for words in (
        "The simulation lacks effects, which the diagnosis names.",
        "The force lags by 4.1 ms",
        "delay: 4.10 ± 0.10 ms",
        "97 % (95 % to 99 %)",
        "coil lag and gas spring",
        "31.0 N",
        "a sine of 3.60 mm, 7.86 Hz, 1.50 V",
        "a gain is visible to calibration only",
    ):
        assert words in text, words


def test_without_a_gap_nothing_is_named_and_no_map_is_drawn(written):
    found = read_diagnosis(written(verdict="no_gap", effects=[], alternatives=[], next_stroke=None))
    assert diagnosis_plots.plot_gap_map(found, "V") is None
    context = make_context(found, "V")
    assert (context["effects"], context["next"], context["severity"]) == ([], "", "good")
    assert ("Part of the gap that they close", "97 % (95 % to 99 %)") not in context["gap"]


def test_an_unexplained_gap_is_a_warning_with_its_probability(written):
    context = make_context(
        read_diagnosis(written(verdict="unexplained", effects=[], unknown_probability=0.93)), "V"
    )
    assert context["severity"] == "warning"
    assert context["sets"][-1] == ("an effect outside the library", "93 %")


def test_the_map_shows_each_gap_at_its_condition_and_phase(written):
    figure = diagnosis_plots.plot_gap_map(read_diagnosis(written()), "V")
    grid = np.asarray(figure.axes[0].images[0].get_array())
    names = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert names == ["10.0 mm, 2.00 Hz, 0 V", "10.0 mm, 2.00 Hz, 0.500 V"]
    assert (grid[0, 0], grid[1, 2], grid.sum()) == (3.0, 12.0, 15.0)


def test_a_fit_in_place_of_a_diagnosis_is_refused(tmp_path):
    path = tmp_path / "fit.json"
    path.write_text('{"schema": "mrbench.fit/1"}')
    with pytest.raises(ReportError, match=r"fit\.json: not a diagnosis written by `mrbench diagnose`"):
        read_diagnosis(path)


def test_bars_show_the_errors_in_order_and_stages_that_are_more_likely_than_not(written):
    left, right = diagnosis_plots.plot_shrinkage(read_diagnosis(written())).axes
    assert [round(bar.get_width(), 3) for bar in left.patches] == [31.0, 13.2, 2.6]
    assert (left.get_ylim(), left.get_xlim()) == ((2.5, -0.5), (0, 1.25 * 31.0))
    colours = [bar.get_facecolor() for bar in right.patches]
    assert (len(set(colours)), colours.count(colours[STAGES.index("force_channel")])) == (2, 1)


def test_a_single_error_has_the_bar_of_one_of_two(written):
    gap = diagnosis_document()["gap"] | {"nominal_n": None}
    left = diagnosis_plots.plot_shrinkage(read_diagnosis(written(effects=[], gap=gap))).axes[0]
    assert (len(left.patches), left.get_ylim()) == (1, (1.5, -0.5))


def test_the_map_omits_motions_without_a_frequency(written):
    where = diagnosis_document()["where"]
    slow, still = (where["map"][0] | {"frequency_hz": value} for value in (0.5, 0.0))
    figure = diagnosis_plots.plot_gap_map(read_diagnosis(written(where=where | {"map": [slow, still]})), "V")
    assert [label.get_text() for label in figure.axes[0].get_yticklabels()] == ["10.0 mm, 0.500 Hz, 0.500 V"]
    assert diagnosis_plots.plot_gap_map(read_diagnosis(written(where=where | {"map": [still]})), "V") is None


def test_no_gap_is_closed_without_a_named_effect(written):
    labels = dict(make_context(read_diagnosis(written(effects=[])), "V")["gap"])
    assert "Part of the gap that they close" not in labels


def test_strokes_that_the_user_held_out_have_their_own_row(written):
    gap = diagnosis_document()["gap"] | {"held_out": {"rmse_n": 2.71, "nrmse": 0.034}}
    rows = dict(make_context(read_diagnosis(written(gap=gap)), "V")["gap"])
    assert "2.71 N, NRMSE 3.4 %" in rows.values()
    assert not any("residual" in label for label in rows)


def test_a_learned_residual_has_a_row_apart_from_the_physics(written):
    learned = {"rmse_n": 2.51, "nrmse": 0.031}
    gap = diagnosis_document()["gap"] | {"held_out": {"rmse_n": 2.71, "nrmse": 0.034, "with_residual": learned}}
    rows = dict(make_context(read_diagnosis(written(gap=gap)), "V")["gap"])
    assert "2.71 N, NRMSE 3.4 %" in rows.values()
    assert rows["The same with the learned residual, which names no cause"] == "2.51 N, NRMSE 3.1 %"


@pytest.mark.parametrize("verdict", ["partly_explained", "unexplained"])
def test_a_gap_that_is_not_explained_offers_the_search_outside_the_library(verdict, written, tmp_path):
    changes = {"verdict": verdict, "provenance": {"logs": {"two strokes.mcap": "", "b.mcap": ""}}}
    command = "mrbench diagnose 'two strokes.mcap' b.mcap --discover --out diagnosis.json --twin twin.json"
    path = written(**changes)
    assert make_context(read_diagnosis(path), "V")["search_command"] == command
    report = page.gather(write_log(tmp_path / "strokes.mcap"), None, path)
    text = page.render(report, page.make_figures(report), "mrbench report", datetime(2026, 5, 4, tzinfo=UTC))
    assert "b.mcap --discover" in text
    assert "This command searches for one" in text


def test_no_search_is_offered_where_the_gap_is_explained_or_a_cause_was_found(written, discovery):
    assert make_context(read_diagnosis(written()), "V")["search_command"] == ""
    found = read_diagnosis(written(verdict="unexplained", effects=[], discovery=discovery))
    assert make_context(found, "V")["search_command"] == ""


def test_an_older_document_offers_the_search_without_the_name_of_a_log(written):
    command = make_context(read_diagnosis(written(verdict="unexplained", effects=[])), "V")["search_command"]
    assert command.startswith("mrbench diagnose LOG --discover")


def test_the_page_shows_a_cause_outside_the_library(written, tmp_path, discovery):
    report = page.gather(write_log(tmp_path / "strokes.mcap"), None, written(discovery=discovery))
    figures = page.make_figures(report)
    assert "discovery" in figures
    text = page.render(report, figures, "mrbench report", datetime(2026, 5, 4, tzinfo=UTC))
    for words in (
        "Cause outside the library",
        "acts at the place “parallel force”",
        "falls from 13.2 N to 3.10 N",
        "added force = sign(velocity)*(a*displacement**2)",
        "N/m²",
        "mounting over acceleration",
        "2.80 N",
        "95 % band",
    ):
        assert words in text, words
    assert "This command searches for one" not in text


def test_the_errors_include_that_with_a_cause_outside_the_library(written, discovery):
    left = diagnosis_plots.plot_shrinkage(read_diagnosis(written(discovery=discovery))).axes[0]
    assert [round(bar.get_width(), 3) for bar in left.patches] == [31.0, 13.2, 2.6, 3.1]

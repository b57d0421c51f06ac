"""Comparison of a diagnosis with the truth of a drawn damper."""

import json
from datetime import UTC, datetime

import pytest
from typer import BadParameter

from bench.commands.report import report
from bench.errors import ReportError
from bench.report import page
from bench.report.diagnosis import Diagnosis
from bench.report.truth import Truth, judge, make_answer_rows, make_truth_rows, read_truth
from tests.support.reports import prediction, write_log
from tests.support.result_documents import diagnosis_document

LATE = diagnosis_document()["effects"][0]


def truth_document(effect="force_delay"):
    return {
        "schema": "mrbench.truth/1", "seed": 4, "effect": effect, "stage": "force_channel", "form": "bessel_chain",
        "meaning": "the amplifier filters more than it reports",
        "parameters": {"delay": {"value": 3.4e-3, "unit": "s", "meaning": "delay of the filter"}},
    }  # fmt: skip


def make(effect="force_delay", **changes):
    return Diagnosis.model_validate(diagnosis_document(**changes)), Truth.model_validate(truth_document(effect))


def test_the_right_name_is_called_right():
    judgement = judge(*make())
    assert judgement == ("good", "The named effect is the true one: force delay.")


def test_a_wrong_name_is_called_wrong():
    judgement = judge(*make("gas_spring"))
    assert judgement.severity == "warning"
    assert judgement.text.startswith("Wrong: it named force delay, and the true effect is gas spring.")
    assert "It is not among the alternatives." in judgement.text


def test_a_wrong_name_states_the_probability_of_the_truth_among_the_alternatives():
    diagnosis, truth = make("coil_lag", alternatives=[{"effects": ["coil_lag"], "probability": 0.12}])
    assert judge(diagnosis, truth).text.endswith("Among its alternatives, the true effect has 12 %.")


def test_an_additional_name_is_partly_right():
    diagnosis, truth = make(effects=[LATE, LATE | {"name": "coil_lag", "stage": "coil"}])
    judgement = judge(diagnosis, truth)
    assert judgement == ("warning", "Partly right: force delay is true, but coil lag is not part of this damper.")


@pytest.mark.parametrize("verdict", ["no_gap", "unexplained"])
def test_no_name_is_called_wrong(verdict):
    diagnosis, truth = make(effects=[], verdict=verdict)
    assert judge(diagnosis, truth).text.startswith(
        "Wrong: it named no effect, and the true effect is force delay."
    )


def test_the_answer_has_name_probability_and_both_errors_in_newtons():
    diagnosis, _ = make()
    rows = dict(make_answer_rows(diagnosis, prediction(rmse=2.6, floor=2.5, before_n=10.0)))
    assert rows == {
        "Named effect": "force delay (force channel), probability 90 %",
        "Held-out strokes, as expected": "law alone 13.2 N, twin 2.60 N, noise floor 2.50 N; "
        "the gap shrinks by 97 % (95 % to 99 %)",
        "Second recording, measured": "law alone 10.0 N, twin 2.60 N, noise floor 2.50 N; the gap shrinks by 99 %",
    }


def test_a_twin_that_is_worse_than_the_law_shrinks_the_gap_by_a_negative_share():
    rows = dict(make_answer_rows(make()[0], prediction(rmse=5.0, floor=2.5, before_n=4.0)))
    assert rows["Second recording, measured"].endswith("the gap shrinks by −92 %")


def test_a_law_at_the_noise_floor_has_no_gap():
    rows = dict(make_answer_rows(make()[0], prediction(rmse=2.5, floor=2.5, before_n=2.52)))
    assert rows["Second recording, measured"].endswith("the law alone has no gap there")


def test_without_a_name_the_verdict_is_the_answer():
    diagnosis, _ = make(effects=[], verdict="no_gap")
    rows = dict(make_answer_rows(diagnosis, prediction(rmse=2.6, floor=2.5)))
    assert rows == {
        "Named effect": "The simulation reproduces the recording: no effect is missing.",
        "Second recording, measured": "law alone 2.60 N, noise floor 2.50 N; the twin has no effect",
    }


def test_the_truth_has_values_with_their_units():
    rows = dict(make_truth_rows(make()[1]))
    assert rows["True effect"] == "force delay (force channel): the amplifier filters more than it reports"
    assert rows["Its form on the rig"] == "bessel chain: delay 3.4 ms"
    assert rows["Drawn by seed"] == "4"


@pytest.fixture
def files(tmp_path):
    """Return log, diagnosis, truth and prediction as files."""
    documents = {
        "diagnosis": diagnosis_document(),
        "truth": truth_document(),
        "unseen": prediction(rmse=2.6, floor=2.5, before_n=10.0).model_dump(by_alias=True),
    }
    for name, content in documents.items():
        (tmp_path / f"{name}.json").write_text(json.dumps(content))
    return write_log(tmp_path / "strokes.mcap"), *(tmp_path / f"{name}.json" for name in documents)


def test_the_page_discloses_the_truth_next_to_the_answer(files):
    log, diagnosis, truth, unseen = files
    content = page.gather(log, None, diagnosis, truth, unseen)
    text = page.render(content, page.make_figures(content), "mrbench report", datetime(2026, 5, 4, tzinfo=UTC))
    for words in (
        "The hidden effect, disclosed",
        "The named effect is the true one",
        "delay 3.4 ms",
        "law alone 10.0 N",
    ):
        assert words in text, words
    content = page.gather(log, None, diagnosis)
    text = page.render(content, page.make_figures(content), "mrbench report", datetime(2026, 5, 4, tzinfo=UTC))
    assert "disclosed" not in text


def test_truth_without_diagnosis_and_prediction_without_truth_are_misuse(files, tmp_path):
    log, diagnosis, truth, unseen = files
    with pytest.raises(BadParameter, match="add --diagnosis FILE"):
        report(log, tmp_path / "report.html", truth=truth)
    with pytest.raises(BadParameter, match="add --truth FILE"):
        report(log, tmp_path / "report.html", diagnosis=diagnosis, unseen=unseen)
    assert not (tmp_path / "report.html").exists()


def test_another_document_is_not_a_truth(files):
    with pytest.raises(ReportError, match="not the truth file of `mrbench sim --draw SEED --truth FILE`"):
        read_truth(files[1])

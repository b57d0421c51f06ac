import dataclasses
import hashlib
import re
from datetime import UTC, datetime
from html.parser import HTMLParser

import numpy as np
import pytest
from typer import BadParameter

from bench.commands.report import report
from bench.errors import LogError, ReportError
from bench.log.reader import read_log
from bench.report import page
from bench.report.content import make_correlation_rows, make_drive_rows, make_header_rows
from bench.report.documents import DriveError, Fit
from bench.report.summary import make_findings
from tests.support.reports import prediction, series, write_log
from tests.support.result_documents import fit_document, write_fit

VOID = {"meta", "img", "br", "link", "hr", "input"}
MADE = datetime(2026, 5, 4, 3, 2, tzinfo=UTC)


class Checked(HTMLParser):
    """Fails on tags that do not close in order; keeps sources, links and text."""

    def __init__(self, text):
        super().__init__()
        self.open, self.sources, self.words = [], [], []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.sources += [value for name, value in attributes if name in ("src", "href")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)

    @property
    def text(self):
        return " ".join(" ".join(self.words).split())


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    return write_log(tmp_path_factory.mktemp("report") / "strokes.mcap")


@pytest.fixture(scope="module")
def made(log):
    """The report of a log with the fit made from it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(page, "predict", lambda fit, log, series_path: (prediction(), series(held_out=True)))
        sha256 = hashlib.sha256(log.read_bytes()).hexdigest()
        return page.gather(log, write_fit(log.with_name("fit.json"), sha256))


@pytest.fixture(scope="module")
def drawn(made):
    return page.make_figures(made)


@pytest.fixture(scope="module")
def html(made, drawn):
    return page.render(made, drawn, "mrbench report strokes.mcap", MADE)


def test_the_page_is_well_formed_and_needs_nothing_from_elsewhere(html):
    sources = Checked(html).sources
    assert len(sources) == 5
    assert all(source.startswith("data:image/png;base64,") for source in sources)
    assert not re.search(r"https?://|@import|url\(", html)
    assert len(html) < 3_000_000


@pytest.mark.parametrize(
    "text",
    [
        "The law reproduces the recorded force with an error of 2.00 N",
        "The noise floor of the recording is 1.90 N",
        "On held-out strokes the force error is 2.04 N (1.7 %), on fitted strokes 1.98 N (1.6 %).",
        "0.1 V 2.00 N 1.05 times 2.1 % 1500",
        "F a 44.862 ± 0.097 N",
        "D y 29.24 ± 0.20 µm",
        "c 0b 2200 ± 3100 N·s/(m·V)",
        "not known hardly seen",
        "Delay of force behind displacement 4 ± 14 µs (explained by the clock errors",
        "k0 and k1 −0.939",
        "cycle to cycle over 6 cycles",
        "mean of simulated minus recorded force over all 3000 samples is −0.23 N",
        "Recorded 2026-05-04 03:02:01 UTC",
        "force N 1000 Hz none 1 ms",
        "Created 2026-05-04 03:02 UTC",
        "mrbench report strokes.mcap",
        "The recording is clean",
    ],
)
def test_the_page_shows_numbers_with_their_units(html, text):
    assert text in Checked(html).text


def test_the_page_names_what_it_was_made_from(html, made):
    assert made.sha256 in html
    assert made.is_fitted_log


def test_names_from_a_log_or_a_fit_are_escaped(made, drawn):
    fit = Fit.model_validate(fit_document(result="<script>alert(1)</script>"))
    attacked = page.render(dataclasses.replace(made, fit=fit), drawn, "<b>", MADE)
    assert "<script>" not in attacked
    assert "&lt;script&gt;" in attacked
    assert "<b>" not in attacked


def test_a_recording_alone_makes_a_page(log):
    alone = page.gather(log, None)
    html = page.render(alone, page.make_figures(alone), "mrbench report", MADE)
    assert "this page shows only the recording" in Checked(html).text
    assert len(Checked(html).sources) == 3
    assert "RMSE" not in html


def describe(log, fit_changes=None, is_fitted_log=True, **errors):
    fit = Fit.model_validate(fit_document(**(fit_changes or {})))
    return {f.text: f.severity for f in make_findings(read_log(log), fit, prediction(**errors), is_fitted_log)}


def test_a_fit_from_another_log_is_noted(log):
    text = " ".join(describe(log, is_fitted_log=False))
    assert "fitted to another recording (strokes.mcap)" in text
    assert "predictions for strokes that the fit did not use" in text
    assert "held-out" not in text


@pytest.mark.parametrize(
    ("rmse", "severity", "words"),
    [
        (1.92, "good", "No model could be noticeably better"),
        (2.14, "plain", "13 % above the noise floor"),
        (9.5, "warning", "5.0 times the noise floor"),
    ],
)
def test_the_error_is_weighed_against_the_floor(log, rmse, severity, words):
    (found,) = [(text, m) for text, m in describe(log, rmse=rmse).items() if text.startswith("The law reproduces")]
    assert words in found[0]
    assert found[1] == severity


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"drive_range": [0.15, 0.3]}, "is 0.1 to 0.3 V, the fitted range is 0.15 to 0.3 V"),
        ({"specimen": "damper 8"}, "The fit is of specimen “damper 8”, this recording of “damper 7”."),
        ({"result": "not converged: stopped"}, "Result of the fit: not converged: stopped."),
    ],
)
def test_limits_of_a_fit_are_warnings(log, changes, words):
    (severity,) = [severity for text, severity in describe(log, changes).items() if words in text]
    assert severity == "warning"


def test_undetermined_parameters_are_named(log):
    text = " ".join(describe(log))
    assert "The strokes determine 1 of the 2 parameters that affect the force. Not determined: c0_b." in text
    assert "A, is a gauge" in text
    assert "the parameters rely on the calibration" in text


def test_a_delay_that_clock_errors_do_not_explain_is_noted(log):
    nuisances = fit_document()["nuisances"]
    late = {**nuisances["force_delay"], "value": 2e-3, "ci95": [1.9e-3, 2.1e-3], "outside_prior": True}
    text = describe(log, {"nuisances": {**nuisances, "force_delay": late}})
    assert "The delay of the force channel, 2.00 ± 0.10 ms, exceeds what clock errors explain." in text


def test_a_lossy_recording_is_a_warning(tmp_path):
    lossy = read_log(write_log(tmp_path / "lossy.mcap", outcome="lossy"))
    assert make_findings(lossy, None, None, is_fitted_log=False)[0].severity == "warning"


def test_the_command_writes_the_page_and_its_plots(log, tmp_path):
    report(log, tmp_path / "page.html", plots=tmp_path / "plots")
    assert "<!doctype html>" in (tmp_path / "page.html").read_text()
    assert {one.name for one in (tmp_path / "plots").iterdir()} == {
        f"{name}.{kind}" for name in ("loops", "time", "recording") for kind in ("png", "svg")
    }


def test_a_bad_fit_or_log_leaves_no_page(log, tmp_path):
    (tmp_path / "fit.json").write_text("{}")
    with pytest.raises(ReportError, match="not a fit"):
        report(log, tmp_path / "page.html", tmp_path / "fit.json")
    with pytest.raises(LogError):
        report(tmp_path / "none.mcap", tmp_path / "page.html")
    with pytest.raises(BadParameter):
        report(log, "-")
    assert not (tmp_path / "page.html").exists()


def test_a_fit_without_its_prediction_is_refused(made, drawn):
    with pytest.raises(ReportError, match="needs its prediction"):
        page.render(dataclasses.replace(made, prediction=None), drawn, "", MADE)


def test_the_recording_begins_at_its_first_sample_not_when_the_agent_was_started(made):
    log = made.log
    later = dataclasses.replace(
        log, samples={**log.samples, "time_ns": log.samples["time_ns"] + 3_600_000_000_000}
    )
    assert dict(make_header_rows(log, ""))["Recorded"] == "2026-05-04 03:02:01 UTC"
    assert dict(make_header_rows(later, ""))["Recorded"] == "2026-05-04 04:02:01 UTC"


@pytest.mark.parametrize(
    ("record", "ending"),
    [
        ({"outcome": "clean", "reason": "", "ending": "completed"}, "completed"),
        ({"outcome": "incomplete", "reason": "paused at a", "ending": "stopped"}, "stopped: paused at a"),
        ({"outcome": "incomplete", "reason": "stopped on request"}, "stopped: stopped on request"),
        ({"outcome": "truncated", "reason": "the recorder was killed"}, "the recorder was killed"),
    ],
)
def test_the_ending_of_the_run_is_named_with_its_reason(made, record, ending):
    log = dataclasses.replace(made.log, metadata={**made.log.metadata, "outcome": record})
    assert dict(make_header_rows(log, ""))["Ending"] == ending


@pytest.mark.parametrize(
    ("drive", "fitted", "is_warned"),
    [
        ((0.1, 0.3), (0.1039, 0.3), False),  # 2 % of the fitted span: 3.9 mV
        ((0.1, 0.3), (0.1041, 0.3), True),
        ((0.1, 0.3), (0.1, 0.2961), False),
        ((0.1, 0.3), (0.1, 0.2959), True),
        ((0.1, 0.1), (0.1009, 0.1009), False),  # at least 1 mV
        ((0.1, 0.1), (0.1011, 0.1011), True),
    ],
)
def test_extrapolation_is_a_warning_above_2_percent_of_the_fitted_drives_or_1_mv(log, drive, fitted, is_warned):
    recorded = read_log(log)
    recorded = dataclasses.replace(recorded, samples={**recorded.samples, "coil_drive": np.array(drive)})
    fit = Fit.model_validate(fit_document(drive_range=fitted))
    texts = [finding.text for finding in make_findings(recorded, fit, prediction(), True)]
    assert any("the fit extrapolates" in text for text in texts) == is_warned


def test_the_recordings_of_a_fit_are_counted_if_there_are_several(log):
    one = fit_document()["provenance"]
    two = one | {"logs": {"a.mcap": "1", "b.mcap": "2"}}
    assert "The law was fitted to 2 recordings: a.mcap, b.mcap." in describe(log, {"provenance": two})
    assert not any("The law was fitted" in text for text in describe(log, {"provenance": one}))


@pytest.mark.parametrize(
    ("rmse", "floor", "severity"),
    [(1.04, 1.0, "good"), (1.06, 1.0, "plain"), (1.19, 1.0, "plain"), (1.21, 1.0, "warning"), (0.5, 0.5, "good"),
     (0.5, 0.0, "warning")],
)  # fmt: skip
def test_an_error_of_5_and_of_20_percent_above_the_floor_is_the_limit(log, rmse, floor, severity):
    found = describe(log, rmse=rmse, floor=floor)
    assert [found[text] for text in found if text.startswith("The law reproduces")] == [severity]


@pytest.mark.parametrize(("result", "severity"), [("converged", None), ("converged at a bound", "plain")])
def test_a_fit_that_converged_with_a_remark_is_no_warning(log, result, severity):
    found = describe(log, {"result": result})
    assert found.get(f"Result of the fit: {result}.") == severity


def test_held_out_errors_are_described_only_if_all_are_known(log):
    for name in ("rmse_n", "nrmse"):
        errors = fit_document()[name] | {"held_out": None}
        assert not any(text.startswith("On held-out") for text in describe(log, {name: errors}))


@pytest.mark.parametrize(("floor", "ratio"), [(0.0, "–"), (0.5, "4.00 times"), (1.0, "2.00 times")])
def test_an_error_by_drive_is_a_multiple_of_the_floor(floor, ratio):
    (row,) = make_drive_rows([DriveError(drive=0.1, unit="V", rmse_n=2.0, nrmse=0.1, samples=7)], floor)
    assert ratio in row
    assert "mostly noise" not in row


@pytest.mark.parametrize(("nrmse", "note"), [(0.99, ""), (1.01, "mostly noise"), (0.0, "")])
def test_a_force_below_twice_the_floor_is_mostly_noise(nrmse, note):
    (row,) = make_drive_rows([DriveError(drive=0.1, unit="V", rmse_n=2.0, nrmse=nrmse, samples=7)], 1.0)
    assert row[-1] == note


def test_correlations_are_listed_from_the_strongest_of_either_sign():
    fit = Fit.model_validate(fit_document(correlations={"a,b": 0.91, "c,d": -0.95, "e,f": 0.93}))
    assert make_correlation_rows(fit) == [("c and d", "−0.950"), ("e and f", "+0.930"), ("a and b", "+0.910")]

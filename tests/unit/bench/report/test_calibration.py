"""Calibration in a report: certificates, overdue channels, intervals with their uncertainty; page and PDF."""

import hashlib
from datetime import UTC, date, datetime

import pytest

from bench.calibration import make_check_record, make_log_text
from bench.log import read_log
from bench.report import page
from bench.report.calibration import make_calibration_findings, make_calibration_rows, make_combined_rows
from bench.report.documents import Fit
from bench.report.formats.pdf import write_pdf
from tests.support.certificates import issue_certificate
from tests.support.reports import prediction, series, write_log
from tests.support.result_documents import estimate, fit_document, write_fit

DAY = date(2026, 5, 4)
OVERDUE = "force: calibration overdue since 2026-05-01 (certificate 4711 of PTB Braunschweig)."


def make_record(*, with_displacement=True):
    force = issue_certificate(date="2025-05-01", due="2026-05-01")
    displacement = issue_certificate("displacement", "m", number="9", date="2025-05-01", due="2027-05-01")
    record = {"force": make_log_text(force, DAY, ""), "displacement": "none given", "coil_drive": "none given"}
    return record | ({"displacement": make_log_text(displacement, DAY, "")} if with_displacement else {})


def make_fit(sha256):
    document = fit_document(sha256)
    added = {"n": estimate(2.0, "1", [1.9, 2.1]), "k0": estimate(2000.0, "N/m", [1990.0, 2010.0])}
    return document | {"parameters": document["parameters"] | added}


def combine(folder, **record):
    path = write_log(folder / "strokes.mcap", calibration=make_record(**record))
    sha256 = hashlib.sha256(path.read_bytes()).hexdigest()
    rows = make_combined_rows(read_log(path).metadata, Fit.model_validate(make_fit(sha256)), sha256)
    return {row.name: row for row in rows}


def test_certificates_are_listed_and_an_overdue_one_is_a_warning(tmp_path):
    log = read_log(write_log(tmp_path / "strokes.mcap", calibration=make_record()))
    force, displacement = make_calibration_rows(log.metadata)
    assert force[:4] == ("force", "4711, PTB Braunschweig (version 1)", "2025-05-01", "2026-05-01")
    assert force[4:] == ("0.20 % (k = 1)", "0.30 %", "overdue")
    assert (displacement.channel, displacement.state) == ("displacement", "valid")
    assert make_calibration_findings(log.metadata) == [("warning", OVERDUE)]


def test_a_failed_check_is_a_warning(tmp_path):
    text = "force: no zero check yet; one is due every 7 days"
    path = write_log(tmp_path / "strokes.mcap", checks=make_check_record((), [text]))
    assert make_calibration_findings(read_log(path).metadata) == [("warning", f"{text}.")]


def test_a_log_without_certificates_has_neither_rows_nor_findings(tmp_path):
    path = write_log(tmp_path / "strokes.mcap", calibration={"force": "none given"})
    log, sha256 = read_log(path), hashlib.sha256(path.read_bytes()).hexdigest()
    assert make_calibration_rows(log.metadata) == make_calibration_findings(log.metadata) == []
    assert make_combined_rows(log.metadata, Fit.model_validate(make_fit(sha256)), sha256) == []


def test_intervals_grow_by_the_gains_that_a_parameter_has(tmp_path):
    """k0 in N/m: 0.2 % of both gains make 0.28 %, 11.1 N/m at 95 %; with 10 N/m of the fit 14.9 N/m."""
    rows = combine(tmp_path)
    assert (rows["k0"].value, rows["k0"].calibration) == ("2000 ± 15", "0.28 %")
    assert rows["D_y"].calibration == rows["F_a"].calibration == "0.20 %"
    assert rows["c0_b"].calibration == "no certificate of drive"
    assert "n" not in rows


def test_a_missing_certificate_is_named(tmp_path):
    rows = combine(tmp_path, with_displacement=False)
    assert rows["k0"] == ("k0", "–", "N/m", "no certificate of displacement")
    assert rows["F_a"].calibration == "0.20 %"


def test_a_fit_of_further_logs_has_no_combined_intervals(tmp_path):
    log = read_log(write_log(tmp_path / "strokes.mcap", calibration=make_record()))
    assert make_combined_rows(log.metadata, Fit.model_validate(make_fit("another")), "this") == []


@pytest.fixture
def report(tmp_path, monkeypatch):
    path = write_log(tmp_path / "strokes.mcap", calibration=make_record())
    monkeypatch.setattr(page, "predict", lambda fit, log, series_path: (prediction(), series(held_out=True)))
    sha256 = hashlib.sha256(path.read_bytes()).hexdigest()
    return page.gather(path, write_fit(tmp_path / "fit.json", sha256, parameters=make_fit(sha256)["parameters"]))


def test_the_page_shows_the_mark_the_certificates_and_the_formula(report):
    html = page.render(report, {}, "mrbench report", datetime(2026, 5, 4, tzinfo=UTC))
    assert OVERDUE in html
    assert "Intervals with calibration" in html
    assert "JCGM 100:2008" in html
    assert "4711, PTB Braunschweig (version 1)" in html


def test_the_pdf_has_the_same_sections(report, tmp_path):
    context = page.make_context(report, "mrbench report", datetime(2026, 5, 4, tzinfo=UTC))
    path = tmp_path / "report.pdf"
    write_pdf(context, page.make_pictures(page.make_figures(report)), path)
    assert path.read_bytes().startswith(b"%PDF")
    assert context["calibration"]
    assert context["fit"]["combined"]

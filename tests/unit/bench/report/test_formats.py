"""Reports as PDF and as a workbook, and the derived values of their strokes."""

import math
from datetime import UTC, datetime

import numpy as np
import pytest
from openpyxl import load_workbook
from pypdf import PdfReader

from bench.log import read_log
from bench.report import gather, make_figures
from bench.report.formats import QUANTITIES, ReportWriter, derive_strokes
from tests.support.reports import CYCLES, columns, write_log

CREATED = datetime(2026, 5, 4, 3, 2, tzinfo=UTC)


@pytest.fixture(scope="module")
def writer(tmp_path_factory):
    log = write_log(tmp_path_factory.mktemp("log") / "run.mcap", specimen="=1+1 µ")
    report = gather(log, None)
    return ReportWriter(report, make_figures(report), "mrbench report run.mcap", CREATED)


@pytest.fixture(scope="module")
def book(writer, tmp_path_factory):
    path = tmp_path_factory.mktemp("book") / "report.xlsx"
    writer.write("xlsx", path)
    return load_workbook(path)


def test_the_pdf_has_the_texts_of_the_page_without_a_fit(writer, tmp_path):
    writer.write("pdf", tmp_path / "report.pdf")
    document = PdfReader(tmp_path / "report.pdf")
    text = "\n".join(page.extract_text() for page in document.pages)
    assert document.metadata.title == "=1+1 µ – damper report"
    assert "2026-05-04 03:02:01 UTC" in text
    assert "No fit was given" in text
    assert f"page {len(document.pages)} of {len(document.pages)}" in text
    assert sum(len(page.images) for page in document.pages) == 3


def test_the_samples_of_the_workbook_are_those_of_the_log(book):
    rows = list(book["Samples"].values)
    names = ("time_s", "displacement_m", "velocity_smoothed_mps", "force_n", "voltage_v")
    assert rows[0] == names
    force = np.array([row[3] for row in rows[1:]])
    np.testing.assert_allclose(force, columns()["force"], rtol=1e-6)


def test_a_text_of_the_workbook_is_never_a_formula(book):
    cells = {row[0].value: row[1] for row in book["Summary"].rows}
    assert (cells["Specimen"].value, cells["Specimen"].data_type) == ("=1+1 µ", "s")


def test_the_workbook_defines_its_derived_values(book):
    terms = {row[0] for row in book["Definitions"].values}
    assert {one.title for one in QUANTITIES.values()} < terms
    assert {"noise floor", "RMSE", "identifiable"} < terms
    head, *strokes = book["Strokes"].values
    assert "Energy per cycle [J]" in head
    assert [row[0] for row in strokes] == ["part 0", "part 1", "part 2"]


def test_derived_values_follow_their_definitions(tmp_path):
    values = derive_strokes(read_log(write_log(tmp_path / "run.mcap")))[0].values
    assert values["cycles"] == pytest.approx(CYCLES, rel=0.01)
    assert values["stroke"] == pytest.approx(0.01, rel=1e-3)
    assert values["mean_drive"] == pytest.approx(0.1)
    assert values["mean_temperature"] is None
    # A damping of 700 N s/m and a friction of 135 N, which acts along four amplitudes.
    friction = 4 * 0.01 * (45 + 900 * 0.1)
    viscous = math.pi * 700 * 4 * math.pi * 0.01**2
    assert values["cycle_energy"] == pytest.approx(viscous + friction, rel=0.05)
    assert values["equivalent_damping"] == pytest.approx(
        values["cycle_energy"] / (math.pi * 4 * math.pi * values["stroke"] ** 2), rel=0.01
    )

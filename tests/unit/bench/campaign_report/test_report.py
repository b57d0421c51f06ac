"""Report on a campaign as page and PDF: content, escaping, and campaigns without results."""

import hashlib
import json
import re
from datetime import UTC, date, datetime
from html.parser import HTMLParser
from io import BytesIO

import pytest
from PIL import Image
from pypdf import PdfReader
from scipy.stats import linregress

from bench.calibration import make_check_record, make_log_text
from bench.campaign_report import gather_campaign, write_campaign_report
from bench.campaign_report.causes import TrendDocument, describe_trend, find_trend
from bench.catalogue import JobRow, RunRow
from bench.commands.campaign.catalogue import open_store
from bench.errors import ReportError
from bench.jobs import FIT_FILE, TREND_FILE
from tests.support.campaign_reports import make_result, prompt_step, run_step, store_campaign
from tests.support.certificates import issue_certificate
from tests.support.reports import write_log
from tests.support.result_documents import estimate, fit_document

CREATED = datetime(2026, 5, 4, 3, 2, tzinfo=UTC)
EVIL = 'Remount <script>alert("x")</script> & go'
RUN = run_step()
STEPS = [RUN, RUN, RUN, prompt_step(EVIL), RUN, RUN, RUN, run_step(drive=0.3), {"rest": {"seconds": 60}}, RUN]
STATES = {8: ("skipped", "deleted by <A>"), 9: ("held_back", "held back after 2 crashes of the bench: killed")}
VALUES = [2600.0, 2604.0, 2602.0, 2640.0, 2644.0, 2642.0]


class Page(HTMLParser):
    """Headings, captions and cells of a page."""

    def __init__(self, text):
        super().__init__()
        self.headings, self.tables, self.tags, self.text = [], {}, set(), ""
        self.open, self.caption = "", ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        if tag in ("h1", "h2", "h3", "caption", "td", "th", "script"):
            self.open, self.held = tag, ""
        if tag == "tr" and self.caption:
            self.tables[self.caption].append([])

    def handle_data(self, data):
        self.text += data
        if self.open:
            self.held += data

    def handle_endtag(self, tag):
        if tag != self.open:
            return
        self.open = ""
        if tag == "caption":
            self.caption = self.held
            self.tables[self.caption] = []
        elif tag in ("td", "th"):
            self.tables[self.caption][-1].append(self.held)
        else:
            self.headings.append((tag, self.held))


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    with open_store(tmp_path_factory.mktemp("data"), is_created=True) as opened:
        yield opened


@pytest.fixture(scope="module")
def stored(store):
    results = [make_result(value, effects=("seal_friction",) if k else ()) for k, value in enumerate(VALUES)]
    return store_campaign(store, STEPS, [*results, make_result(2700.0)], STATES, "stopped")


@pytest.fixture(scope="module")
def report(store, stored):
    return gather_campaign(store, stored)


@pytest.fixture(scope="module")
def page(report, tmp_path_factory):
    return write(report, tmp_path_factory.mktemp("page"))


def write(report, folder):
    path = folder / "report.html"
    write_campaign_report(report, "html", path, "mrbench campaign report --out 'a & b.html'", CREATED)
    page = Page(path.read_text("utf-8"))
    page.source = path.read_text("utf-8")
    return page


def find(page, beginning):
    return next(rows for caption, rows in page.tables.items() if caption.startswith(beginning))


def test_the_head_names_document_hash_seed_operator_bench_times_and_state(page, store, stored):
    key = store.table.get(stored.id).key
    assert len(key) == 64
    for text in ("mrbench.campaign/1, 10 steps", key, "M. <Curie> & Co", "rig agent", "stopped: ended"):
        assert text in page.text
    assert re.search(r"Seed\s*7\s", page.text)
    assert re.search(r"Started\s*2026-09-21 14:13:20 UTC\s*Ended\s*2026-09-21 16:43:20 UTC", page.text)


def test_the_page_is_self_contained_and_foreign_text_is_escaped(page):
    assert "script" not in page.tags
    assert EVIL in page.text
    assert "torque <b>12</b> N m" in page.text
    assert not re.search(r"https?://|@import|url\(", page.source)
    assert page.source.count("data:image/png;base64,") == 1


def test_headings_have_no_gaps_and_every_table_has_a_caption_and_a_header(page):
    levels = [int(tag[1]) for tag, _ in page.headings]
    assert levels[0] == 1
    assert set(levels[1:]) == {2}
    assert page.source.count("<table") == page.source.count("<caption") == len(page.tables)
    assert all(all(cell for cell in rows[0]) for rows in page.tables.values())
    # A region that scrolls is reached by the keyboard.
    assert page.source.count('class="scroll" tabindex="0" role="group" aria-label=') == len(page.tables)


def test_the_conditions_of_each_run_are_stated_with_mounting_temperature_and_start(page):
    rows = find(page, "Complete runs")
    assert rows[1] == [
        "1",
        "MR-1",
        "quick",
        "of the method",
        "1",
        "23.5 °C",
        "2026-09-21 14:18:57 UTC",
        "23.0 s",
        "clean",
    ]
    assert [row[4] for row in rows[1:]] == ["1", "1", "1", "2", "2", "2", "2"]
    assert rows[7][3] == "0.3 V"


def test_each_run_has_its_parameters_with_interval_and_the_force_error(page):
    first, second = find(page, "Parameters, MR-1, quick, drive of the method"), find(page, "Fit and diagnosis")
    assert first[0] == ["Parameter", "Unit", "Run 1", "Run 2", "Run 3", "Run 4"]
    assert first[1] == ["k0", "N/m", "2600.0 ± 4.0", "2604.0 ± 4.0", "2602.0 ± 4.0", "2640.0 ± 4.0"]
    assert second[2] == ["2", "2.70 N", "2.50 N", "1.08 times", "explained", "seal friction", ""]


def test_a_drift_is_stated_per_run_and_per_hour_with_the_effect_behind_it(page, report):
    row = find(page, "Drift, MR-1, quick, drive of the method")[1]
    assert row[:2] == ["k0", "N/m"]
    assert row[4:] == ["rises", "none"]
    line = report.series[0].drift_per_run
    assert line.slope == pytest.approx(linregress(range(6), VALUES).slope)
    assert (
        "drift of k0; effect behind it: seal friction, named by 5 of 6 diagnoses (run 2, 3, 4, 5, 6)" in page.text
    )
    assert "1 of 1 parameters drift over the runs: k0" in page.text


def test_repeatability_and_reproducibility_are_those_of_the_mountings(page):
    row = find(page, "Scatter, MR-1, quick, drive of the method")[1]
    # Within: 8/2 = 4 in both; between: (3·40²/2 - 4)/3 = 798.67; fit: 4/1.96.
    assert row[:4] == ["k0", "N/m", "2, 6", "2622"]
    assert row[4].startswith("2.00 (")
    assert row[5:] == ["28.3", "28.3", "5.60", "79.3", "0.98"]


def test_a_single_run_names_the_runs_that_are_missing(page):
    assert "MR-1, quick, 0.3 V, all parameters: missing: 1 more run in the same mounting" in page.text
    assert find(page, "Scatter, MR-1, quick, 0.3 V")[1][4:] == ["–"] * 6
    assert find(page, "Drift, MR-1, quick, 0.3 V")[1][2:] == ["–", "–", "too few runs", "none"]


def test_steps_that_were_not_done_have_their_reasons(page):
    rows = find(page, "Skipped, failed")[1:]
    assert rows[0] == ["s0009", "rest 60 s", "skipped", "deleted by <A>"]
    assert rows[1][2:] == ["held back", "held back after 2 crashes of the bench: killed"]


def test_setup_steps_have_their_times_and_results(store, tmp_path):
    steps = [{"setup": {"step": "tare"}}, RUN, {"setup": {"step": "home"}}, {"setup": {"step": "unmount"}}]
    states = {0: ("done", "3.10 N are subtracted"), 2: ("failed", "no switch"), 3: ("pending", "")}
    page = write(gather_campaign(store, store_campaign(store, steps, [], states)), tmp_path)
    rows = find(page, "Setup steps")[1:]
    assert [(row[0], row[1], row[4], row[5]) for row in rows] == [
        ("s0001", "setup step tare", "done", "3.10 N are subtracted"),
        ("s0003", "setup step home", "failed", "no switch"),
    ]
    assert rows[0][2:4] == ["2026-09-21 14:18:20 UTC", "2026-09-21 14:19:20 UTC"]


def test_questions_and_answers_name_the_person_and_the_note(page):
    (row,) = find(page, "Answers of persons")[1:]
    assert (row[0], row[1], row[4], row[5], row[6]) == ("s0004", EVIL, "A. Meyer", "torque <b>12</b> N m", "–")


def test_the_photos_of_answers_are_shown_and_what_cannot_be_shown_is_named(store, tmp_path):
    stored = store_campaign(store, [prompt_step("Show <it>"), prompt_step("Show that"), RUN], [])
    for number, name in enumerate(("upright.png", "broken.jpg")):
        item = stored.state.items[number].model_copy(update={"photo": name})
        items = (*stored.state.items[:number], item, *stored.state.items[number + 1 :])
        stored = stored._replace(state=stored.state.model_copy(update={"items": items}))
    Image.new("RGBA", (1500, 3000), "red").save(store.catalogue.folder / "upright.png")
    (store.catalogue.folder / "broken.jpg").write_bytes(b"\xff\xd8\xff\xe0 no photo")
    report = gather_campaign(store, stored)
    photo = report.photos["s0001"]
    assert Image.open(BytesIO(photo.content)).size == (600, 1200)
    assert photo.width == pytest.approx(0.3)
    page = write(report, tmp_path)
    assert page.source.count('<figure class="photo">') == page.source.count("data:image/jpeg;base64,") == 1
    assert 'alt="Photo to step s0001: Show &lt;it&gt;"' in page.source
    assert "Not shown, because they are missing, unreadable or too many: broken.jpg of step s0002." in page.text
    write_campaign_report(report, "pdf", tmp_path / "report.pdf", "", CREATED)
    assert sum(len(one.images) for one in PdfReader(tmp_path / "report.pdf").pages) == 1


def test_messages_have_no_restore_points(page):
    kinds = {row[1] for row in find(page, "Messages")[1:]}
    assert "edit" in kinds
    assert "restore point" not in kinds


def test_the_pdf_has_the_texts_and_plots_of_the_page(report, tmp_path):
    write_campaign_report(report, "pdf", tmp_path / "report.pdf", "mrbench campaign report", CREATED)
    document = PdfReader(tmp_path / "report.pdf")
    text = "".join("".join(one.extract_text() for one in document.pages).split())
    assert document.metadata.title == "night – campaign report"
    for part in (
        EVIL,
        "s_r: standard deviation of runs in one mounting",
        "2600.0 ± 4.0",
        "held back after 2 crashes",
    ):
        assert part.replace(" ", "") in text
    assert f"page1of{len(document.pages)}" in text
    assert sum(len(one.images) for one in document.pages) == 1


def test_a_pdf_that_cannot_be_written_is_an_error(report, tmp_path):
    with pytest.raises(ReportError, match="no such file"):
        write_campaign_report(report, "pdf", tmp_path / "none" / "report.pdf", "", CREATED)


@pytest.mark.parametrize(
    ("steps", "results", "text"),
    [
        ([RUN], [], "No run has been identified"),
        ([RUN, RUN], [make_result(2600.0)], "Without a fit: run 2"),
        ([RUN], [make_result(2600.0, None)], "1 run after a remount"),
        ([{"rest": {"seconds": 5}}], [], "No run of this campaign has been identified"),
    ],
)
def test_campaigns_with_few_results_state_what_is_missing(store, tmp_path, steps, results, text):
    page = write(gather_campaign(store, store_campaign(store, steps, results)), tmp_path)
    assert text in page.text


def test_a_campaign_in_progress_says_so(store, tmp_path):
    stored = store_campaign(store, [RUN, RUN], [], {1: ("pending", "")}, "paused")
    page = write(gather_campaign(store, stored), tmp_path)
    assert "The campaign is not finished, its state is paused" in page.text
    assert "1 of 2 steps have not been completed." in page.text
    assert "Latest change" in page.text


def test_a_negative_estimate_is_shown_as_clipped_zero(store, tmp_path):
    steps = [RUN, RUN, prompt_step(), RUN, RUN]
    results = [make_result(value) for value in (2600.0, 2640.0, 2610.0, 2630.0)]
    page = write(gather_campaign(store, store_campaign(store, steps, results)), tmp_path)
    assert find(page, "Scatter")[1][5] == "0 (estimate negative)"


def test_runs_with_proposed_strokes_do_not_count_as_repetitions(store):
    steps = [RUN, {"next_stroke": {"at_most": 2}}, RUN]
    stored = store_campaign(store, steps, [make_result(2600.0), make_result(2602.0)])
    stroke = stored.state.facts[0].model_copy(update={"run": "stroke", "item": stored.state.items[1].id})
    results = dict(stored.state.results) | {"stroke": make_result(9999.0)}
    values = {"facts": (stored.state.facts[0], stroke, stored.state.facts[1]), "results": results}
    (series,) = gather_campaign(store, stored._replace(state=stored.state.model_copy(update=values))).series
    assert series.values == (2600.0, 9999.0, 2602.0)
    assert (series.scatter.runs, series.scatter.mean) == (2, 2601.0)


def add_calibrated_run(store, run, **record):
    """Add a run with the metadata of the test to the catalogue, with a fit of its own; return its fit."""
    log = write_log(store.catalogue.folder / f"{run}.mcap", **record)
    sha256 = hashlib.sha256(log.read_bytes()).hexdigest()
    document = fit_document(sha256)
    added = {"n": estimate(2.0, "1", [1.9, 2.1]), "k0": estimate(2000.0, "N/m", [1990.0, 2010.0])}
    document["parameters"] |= added
    result = store.catalogue.folder / f"{run}-fit"
    result.mkdir()
    (result / FIT_FILE).write_text(json.dumps(document))
    store.catalogue.add(RunRow(id=run, method="quick", started=CREATED, state="ended", log=log.name,
                               log_sha256=sha256))  # fmt: skip
    store.catalogue.add(JobRow(id=f"{run}-job", run_id=run, kind="identify", key=run, settings={}, state="done",
                               created=CREATED, finished=CREATED, result=result.name))  # fmt: skip


def test_the_calibration_of_the_runs_and_the_intervals_with_it_are_stated(tmp_path):
    day = date(2026, 5, 4)
    force = make_log_text(issue_certificate(date="2025-05-01", due="2026-05-01"), day, "")
    way = make_log_text(issue_certificate("displacement", "m", date="2025-05-01", due="2027-05-01"), day, "")
    failed = "force: no zero check yet; one is due every 7 days"
    with open_store(tmp_path, is_created=True) as store:
        stored = store_campaign(store, [RUN] * 5, [])
        for number in range(3):
            calibration = {"force": force, "coil_drive": "none given"}
            if number:
                calibration["displacement"] = way
            checks = make_check_record((), [failed] if number == 2 else [])
            add_calibrated_run(store, f"fact-{number}", calibration=calibration, checks=checks)
        add_calibrated_run(store, "fact-3", calibration={"force": "none given"})
        report = gather_campaign(store, stored)
    page = write(report, tmp_path)
    rows = find(page, "Certificates at the start")[1:]
    assert [(row[0], row[6], row[7]) for row in rows] == [
        ("force", "overdue", "1–3"), ("displacement", "valid", "2–3"),
    ]  # fmt: skip
    overdue = "force: calibration overdue since 2026-05-01 (certificate 4711 of PTB Braunschweig)."
    assert find(page, "Overdue channels")[1:] == [[overdue, "1–3"], [f"{failed}.", "3"]]
    assert f"{failed} (run 3)." in page.text
    assert "name no certificate: run 4." in page.text
    assert "cannot be read, so that only deficiencies are known: run 5." in page.text
    table = find(page, "Intervals with calibration, MR-1")
    assert table[0] == ["Parameter", "Unit", "Run 1", "Run 2", "Run 3"]
    row = next(row for row in table if row[0] == "k0")
    assert row[1:] == ["N/m", "– (no certificate of displacement)", "2000 ± 15 (0.28 %)", "2000 ± 15 (0.28 %)"]


def test_the_trend_of_a_specimen_is_found_by_its_newest_run(store, tmp_path):
    assert find_trend(store.catalogue, ["run-a"]) is None
    folder = store.catalogue.folder / "trend"
    folder.mkdir()
    change = {"quantity": "gas_spring.preload", "unit": "N", "way": "grows", "per_run": 2.0, "since": "b.mcap"}
    document = {"schema": "mrbench.trend/1", "changes": [change], "explanation": "Over 3 runs: preload rises."}
    (folder / TREND_FILE).write_text(json.dumps(document))
    store.catalogue.add(RunRow(id="run-a", method="quick", started=CREATED, state="finished", log="a.mcap"))
    store.catalogue.add(JobRow(id="job", run_id="run-a", kind="trend", key="k", settings={}, state="done",
                               created=CREATED, finished=CREATED, result="trend"))  # fmt: skip
    found = find_trend(store.catalogue, ["run-0", "run-a"])
    assert isinstance(found, TrendDocument)
    assert "preload rises" in describe_trend("MR-1", found)
    (folder / TREND_FILE).write_text("{}")
    assert find_trend(store.catalogue, ["run-a"]) is None
    assert "was not computed" in describe_trend("MR-1", None)

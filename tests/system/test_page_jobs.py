"""Queue of the jobs at the web page, in a real browser."""

import re
from datetime import UTC, datetime, timedelta

import pytest

from tests.support.fake_page_service import FakeBench, fit_job
from tests.support.page_in_browser import browser_test, operate_page


@pytest.fixture(scope="module")
def bench():
    """Return a bench with a running and two queued jobs; the last request is listed first."""
    made = FakeBench()
    created = (datetime.now(UTC) - timedelta(hours=2)).isoformat()
    running = {"stage": "refine", "fraction": 0.4, "created": created}
    made.runs["run-2"]["jobs"][0] |= running
    queued = {"predict": 2, "diagnose": 1}
    made.runs["run-1"]["jobs"] = [
        fit_job("run-1", "queued", id=f"{kind}-1", kind=kind, position=position, created=created)
        for kind, position in queued.items()
    ]
    return made


@pytest.fixture(scope="module")
def seen(bench):
    """Return what a person sees who looks after the queue."""
    return operate_page(bench, "use_jobs.mjs")


@browser_test
def test_the_queue_has_an_address_and_is_reached_from_the_health(seen):
    assert seen["errors"] == []
    assert seen["address"] == "#/jobs"
    assert seen["focusedTitle"] == "Jobs"


@browser_test
def test_running_jobs_come_first_then_the_queued_ones_in_their_order(seen):
    rows = [[cell.strip() for cell in re.split(r"[\t\n]+", row)] for row in seen["rows"]]
    assert [row[:-2] for row in rows] == [
        ["run-2", "identify", "running", "refine", "identify: refine, start 3 of 8", "40 %"],
        ["run-1", "diagnose", "queued, number 1", "–", "–"],
        ["run-1", "predict", "queued, number 2", "–", "–"],
    ]
    assert all(re.fullmatch(r"2 h \d\d min", row[-2]) for row in rows)


@browser_test
def test_the_names_of_the_buttons_differ_by_kind_and_run(seen):
    assert seen["buttons"] == [
        "Cancel identify of run run-2",
        "Cancel diagnose of run run-1",
        "Cancel predict of run run-1",
    ]
    (in_run,) = seen["inRun"]
    assert re.fullmatch(r"Cancel predict: run of 2025-03-04 \d\d:11:30 UTC\S*", in_run)


@browser_test
def test_a_cancelled_job_leaves_the_queue_and_the_focus_stays_in_the_view(seen, bench):
    paths = [path for path, _ in bench.posted if path.startswith("jobs/")]
    assert paths == ["jobs/diagnose-1/cancel", "jobs/job-run-2/cancel", "jobs/predict-1/cancel"]
    assert seen["answer"].startswith("The cancellation of diagnose of run run-1 was requested.")
    assert seen["focusedAfterwards"] == "Jobs"


@browser_test
def test_the_queue_is_accessible(seen):
    assert seen["findings"] == []

"""Control of a run, retry of a job, check of a log and search at the web page, in a real browser."""

import json
import re

import pytest

from tests.support.fake_page_service import CHECKPOINT, HASH, PAUSE, FakeBench
from tests.support.page_in_browser import browser_test, operate_page


@pytest.fixture(scope="module")
def bench():
    return FakeBench()


@pytest.fixture(scope="module")
def seen(bench):
    return operate_page(bench, "control_run.mjs")


@browser_test
def test_each_state_offers_the_buttons_that_have_a_function_in_it(seen):
    assert seen["errors"] == []
    assert seen["buttons"] == {"idle": [], "running": ["pause", "abort"], "tripped": ["reset"]}
    assert min(seen["heights"]) >= 44


@browser_test
def test_a_requested_pause_says_when_it_takes_effect(seen):
    assert f"Pause: {PAUSE}" in seen["pause"]
    assert seen["pauseDisabled"]


@browser_test
def test_a_paused_run_can_be_resumed_beside_start(seen):
    assert seen["paused"] == f"The last run was paused after {CHECKPOINT}; Resume continues it."
    start, resume = seen["places"]
    assert start == resume
    assert resume[1] >= 44
    assert seen["focused"] == "stop"
    assert [seen["resumeWhileRunning"], seen["resumeAfterwards"]] == [False, False]


@browser_test
def test_the_buttons_call_the_service(seen, bench):
    paths = [path for path, _ in bench.posted]
    wanted = [
        "runs/run-4/pause",
        "runs/run-4/resume",
        "bench/abort",
        "jobs/job-run-3/retry",
        "runs/run-3/integrity",
        "runs/run-3/resume",
    ]
    assert [path for path in paths if path in wanted] == wanted


@browser_test
def test_a_retry_asks_for_a_reason_and_sends_it(seen, bench):
    assert "The job identify is failed: the worker was killed." in seen["question"]
    assert seen["keptOpen"]
    sent = [json.loads(body) for path, body in bench.posted if path == "jobs/job-run-3/retry"]
    assert sent == [{"reason": "more memory"}]


@browser_test
def test_a_changed_log_is_named_with_its_recorded_hash(seen):
    assert "The log is changed; results may not be its own." in seen["facts"]
    assert HASH in seen["facts"]


@browser_test
def test_a_resumed_run_leads_to_the_bench(seen):
    assert seen["address"] == "#/bench"


@browser_test
def test_a_search_stands_in_the_address_and_survives_a_reload(seen, bench):
    assert "lossy" in seen["found"]
    assert seen["search"] == "#/runs?outcome=lossy&from=2025-03-04"
    assert seen["kept"] == "lossy"
    asked = [search for search in bench.searches if search.get("outcome") == "lossy"]
    assert all(re.fullmatch(r"2025-03-0[34]T\d\d:\d\d:00.000Z", search["from"]) for search in asked)
    assert len(asked) >= 2

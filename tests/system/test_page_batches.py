"""Analysis of several runs, and changes since another version, on the web page in a real browser."""

import json
import re

import pytest

from tests.support.fake_batches import OLDER_VERSION, REASON
from tests.support.fake_page_service import FakeBench, fit_job
from tests.support.page_in_browser import browser_test, operate_page


@pytest.fixture(scope="module")
def bench():
    """Return a fake bench whose first run has results of two versions."""
    made = FakeBench()
    jobs = made.runs["run-1"]["jobs"]
    for job in jobs:
        job["version"] = "0.1.0"
    former = [
        fit_job("run-1", "done", id=f"former-{kind}", kind=kind, version=OLDER_VERSION)
        for kind in ("identify", "diagnose")
    ]
    jobs[:0] = former
    return made


@pytest.fixture(scope="module")
def seen(bench):
    """Return what a person sees who analyses two runs and reads the changes of a third result."""
    return operate_page(bench, "analyse_runs.mjs")


@browser_test
def test_selected_runs_are_analysed_at_an_address_of_their_own(seen, bench):
    assert seen["errors"] == []
    assert (seen["without"], seen["offered"]) == (True, ["Diagnosis", "Identification"])
    assert seen["address"] == "#/batches/batch-1"
    assert seen["title"]
    posted = [json.loads(body) for path, body in bench.posted if path == "batches"]
    assert posted == [{"kind": "diagnose", "runs": ["run-1", "run-3"]}, {"kind": "identify", "runs": ["run-1"]}]


@browser_test
def test_the_table_follows_the_jobs_and_keeps_the_focus(seen):
    first, last = (row.split("\t") for row in seen["running"])
    assert (first[2].strip(), last[2].strip()) == ("done", "running")
    assert last[3:] == ["–"] * 5
    assert seen["focusStays"]
    assert re.fullmatch(r"Diagnosis of 2 runs, requested 2025-03-04 .* UTC\S*: all have ended\.", seen["note"])
    assert REASON in seen["ended"][1]


@browser_test
def test_each_run_has_its_answer_with_units(seen):
    answer = ["Answer", "Probability", "Law alone [N]", "With effects [N]", "Gap closed"]
    assert seen["heads"] == ["Run", "Specimen, method", "Job", *answer]
    assert seen["ended"][0].split("\t")[3:] == ["explained: gas spring", "97 %", "5.4", "2.51", "98 %"]
    assert seen["inLbf"].split("\t")[5:7] == ["1.21", "0.564"]
    assert seen["fit"][0].split("\t")[3:] == ["converged", "1.31", "1.26", "1.04"]
    assert seen["opened"] == "#/runs/run-1"


@browser_test
def test_the_table_is_saved_for_a_spreadsheet(seen):
    name, head = seen["file"]
    assert name == "batch-batch-1.csv"
    assert head.startswith("run,specimen,method,started,job,state")


@browser_test
def test_an_address_without_a_batch_says_what_to_do(seen):
    assert seen["problems"] == {
        "#/batches": "The address names no batch. Select runs in Runs, and press Analyse selected.",
        "#/batches/none": "The batch cannot be shown: there is no batch none.",
    }


@browser_test
def test_provenance_tells_what_has_changed_since_another_version(seen):
    assert f"Fit: changes since version {OLDER_VERSION}" in seen["changes"]
    assert "The answer is the same: converged." in seen["changes"]
    differing = r"1 of \d+ parameters differ: each value is outside the 95 % interval of the other\."
    assert any(re.fullmatch(differing, line) for line in seen["changes"])
    assert [row.split("\t")[0] for row in seen["table"]] == ["k0"]
    assert f"Diagnosis: changes since version {OLDER_VERSION}" in seen["changes"]
    assert "The answer was “partly explained” and is “explained”." in seen["changes"]
    assert "Effects named only now: gas spring." in seen["changes"]
    assert "Effects named only before: seal friction." in seen["changes"]


@browser_test
def test_batch_and_changes_are_accessible_in_all_widths_and_both_schemes(seen):
    assert {view: found for view, found in seen["findings"].items() if found} == {}

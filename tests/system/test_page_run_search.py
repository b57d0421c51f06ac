"""Search for runs by tag and in the trash at the web page, in a real browser."""

import pytest

from tests.support.fake_page_service import FakeBench
from tests.support.fake_results import MADE
from tests.support.page_in_browser import browser_test, operate_page


@pytest.fixture(scope="module")
def bench():
    """Return a bench with a tagged run, and another run in the trash."""
    made = FakeBench()
    made.runs["run-1"]["tags"] = ["seal"]
    made.runs["run-0"]["trashed"] = MADE.isoformat()
    return made


@pytest.fixture(scope="module")
def seen(bench):
    """Return what a person finds."""
    return operate_page(bench, "search_runs.mjs")


@browser_test
def test_a_tag_is_searched_and_stands_in_the_address(seen, bench):
    assert seen["errors"] == []
    shown, row = seen["tagged"]
    assert shown == "#/runs?tag=seal"
    assert "09:11:30" in row
    assert seen["keptTag"] == "seal"
    assert any(search.get("tag") == "seal" for search in bench.searches)


@browser_test
def test_the_label_of_the_text_names_all_that_is_searched(seen):
    assert seen["textLabel"].strip() == "Text in specimen, method, operator, reason or a note"


@browser_test
def test_a_run_in_the_trash_is_found_by_its_bookmark_and_restored(seen, bench):
    shown, row = seen["trashed"]
    assert shown == "#/runs?trash=true"
    assert "In the trash since 2025-03-04" in row
    assert seen["keptTick"]
    assert [row for row in seen["restored"] if "In the trash" in row] == []
    assert seen["empty"] == 0
    assert bench.runs["run-0"]["trashed"] is None


@browser_test
def test_the_search_is_accessible(seen):
    assert seen["findings"] == []

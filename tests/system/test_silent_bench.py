"""Page of a bench whose agent is silent: its state follows the age of the last stamp."""

import re

import pytest

from tests.support.fake_page_service import FakeBench
from tests.support.page_in_browser import browser_test, node_test, operate_page, run_module


@pytest.fixture(scope="module")
def seen():
    return operate_page(FakeBench(), "silent_bench.mjs")


@node_test
def test_the_age_of_a_stamp_does_not_depend_on_its_arrival():
    ages = run_module("judge_age.mjs", "live/service_clock.js")
    assert ages["before"]
    assert ages["fresh"] == 0
    assert ages["silent"] == 33
    assert ages["waited"] == 32
    assert ages["shorter"] == pytest.approx(32.2)
    assert ages["present"] == pytest.approx(0.1)


@browser_test
def test_a_silent_agent_is_never_shown_as_alive_again(seen):
    assert seen["errors"] == []
    assert [word for _, word in seen["words"]] == ["Idle", "No connection"]
    assert seen["wordsAfterReload"][-1][1] == "No connection"
    assert {word for _, word in seen["wordsAfterReload"]} <= {"Connecting", "No connection"}


@browser_test
def test_the_age_counts_from_the_last_status_also_after_a_reload(seen):
    before, after = (int(re.match(r"No data for (\d+) s", seen[k]["line"])[1]) for k in ("after", "afterReload"))
    assert before >= 8
    assert after >= before + 4


@browser_test
def test_instruments_and_start_show_that_nothing_is_known(seen):
    marks = seen["after"]["marks"]
    assert len(marks) > 0
    assert {tuple(mark) for mark in marks} == {("mark", "no data")}
    assert seen["after"]["startDisabled"]
    assert re.fullmatch(r"no samples for \d+ s", seen["after"]["liveAge"])

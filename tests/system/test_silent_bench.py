"""Page of a bench whose agent is silent: its state follows the age of the last stamp."""

import re

import pytest

from tests.support.fake_page_service import SILENCE, FakeBench
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
    assert {tuple(numbers) for numbers in seen["after"]["numbers"]} == {("–", "–")}
    assert re.fullmatch(r"no samples for \d+ s", seen["after"]["liveAge"])
    assert seen["after"]["segment"] == "Run not known"


@browser_test
def test_the_health_says_what_is_not_known(seen):
    before, after, reloaded = (seen[name]["health"] for name in ("before", "after", "afterReload"))
    assert before["Agent"] == "mark good: ready"
    assert before["Wires"] == "mark bad: thermometer not connected"
    assert before["Clocks"] == "mark good: within 18 µs"
    for health in (after, reloaded):
        assert health["Wires"] == health["Clocks"] == "mark plain: not known"
        assert health["Agent"] == f"mark bad: {SILENCE}"
        assert health["Worker"] == "mark good: ready"  # the service itself answers


@browser_test
def test_no_preparation_step_counts_as_done_or_can_be_requested(seen):
    before, after, reloaded = (seen[name] for name in ("before", "after", "afterReload"))
    assert (before["steps"], before["reference"]) == (2, "position known, no specimen clamped")
    assert before["enabled"] > 0
    for shown in (after, reloaded):
        assert (shown["steps"], shown["enabled"], shown["reference"]) == (0, 0, "not known")


@browser_test
def test_warnings_of_a_silent_agent_are_not_known(seen):
    assert seen["before"]["warnings"] == FakeBench().status()["warnings"]
    assert seen["after"]["warnings"] == ["No data: the warnings are not known."]
    assert seen["afterReload"]["warnings"] == []

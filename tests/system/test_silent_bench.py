"""Page of a bench whose agent is silent: its state follows the age of the last stamp."""

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.support.fake_page_service import STATIC, FakeBench
from tests.support.page_in_browser import browser_test, operate_page

NODE = shutil.which("node")
JUDGE_AGE = Path(__file__).with_name("javascript") / "judge_age.mjs"


@pytest.fixture(scope="module")
def seen():
    return operate_page(FakeBench(), "silent_bench.mjs")


@pytest.mark.skipif(NODE is None, reason="Node is not installed; it runs the modules of the page")
def test_the_age_of_a_stamp_does_not_depend_on_its_arrival():
    command = [NODE, str(JUDGE_AGE), str(STATIC / "live" / "service_clock.js")]
    ages = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
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

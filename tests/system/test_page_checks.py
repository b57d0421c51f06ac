"""Checks in the web page, in a real browser: list, control charts, units, new baseline, start."""

import json

import pytest

from tests.support.checks import MOUNTED
from tests.support.fake_page_service import FakeBench
from tests.support.page_in_browser import browser_test, operate_page


@pytest.fixture(scope="module")
def bench():
    bench = FakeBench()
    bench.refusals = 0
    return bench


@pytest.fixture(scope="module")
def seen(bench):
    """Return what a person sees who looks at the checks and starts one."""
    return operate_page(bench, "use_checks.mjs")


def find_row(rows, channel):
    return next(text for text in rows if text.startswith(channel))


@browser_test
def test_each_channel_has_state_latest_check_and_age(seen):
    assert seen["errors"] == []
    assert len(seen["list"]) == 4
    force = find_row(seen["list"], "force")
    assert "out of control" in force
    assert "is above the limit" in force
    assert "24 h 00 min ago" in force or "1 days ago" in force
    assert "in control" in find_row(seen["list"], "displacement")
    assert "7 of 20" in find_row(seen["list"], "coil voltage")


@browser_test
def test_quantities_have_the_units_of_the_person(seen):
    assert "\u00a0N" in find_row(seen["list"], "force")
    assert "\u00a0mm" in find_row(seen["list"], "displacement")
    assert "\u00a0V" in find_row(seen["list"], "coil voltage")
    assert "\u00a0lbf" in find_row(seen["otherUnits"], "force")
    assert "\u00a0in" in find_row(seen["otherUnits"], "displacement")
    assert "in lbf, over the number of the check" in seen["otherChart"]


@browser_test
def test_the_chart_has_its_address_figure_limits_and_table(seen):
    assert seen["address"] == "#/calibration?check=force"
    assert seen["focused"] == f"Chart of the force, specimen {MOUNTED}"
    assert seen["drawn"] == 1
    assert "first 20 checks (ISO 7870-2): centre" in seen["chart"]
    assert "in N, over the number of the check" in seen["chart"]
    assert len(seen["table"]) == 26
    assert "beyond limits" in seen["table"][0]
    assert "baseline" in seen["table"][-1]


@browser_test
def test_no_finding_of_axe_core_no_small_control_no_sideways_scroll(seen):
    assert {place: found for place, found in seen["findings"].items() if found} == {}


@browser_test
def test_a_new_baseline_needs_a_reason(seen):
    assert seen["asked"] == "reason"
    assert "0 of 20" in seen["renewed"]


@browser_test
def test_a_check_is_started_and_the_next_key_can_stop_it(seen, bench):
    assert seen["specimen"] == MOUNTED
    assert seen["afterStart"] == "stop"
    started = [json.loads(body) for path, body in bench.posted if path == "runs"]
    assert started == [{"method": f"{kind}_check", "specimen": MOUNTED} for kind in ("zero", "shunt")]


@browser_test
def test_the_shunt_has_a_row_and_a_chart_of_its_own(seen):
    row = find_row(seen["list"], "force with the shunt")
    assert "in control" in row
    assert "1000" in row
    assert seen["shuntAddress"] == "#/calibration?check=force.shunt"
    assert f"Chart of the force with the shunt, specimen {MOUNTED}" in seen["shuntChart"]
    assert "Change by the shunt of the force in N, over the number of the check" in seen["shuntChart"]

"""Checks over REST: records, charts, new baselines, and what a failed check does to the next run."""

import pytest

from tests.support.checks import IN_CONTROL, MOUNTED, store_checks, write_check_log, write_shunt_log

API = "/api/v1/checks"


@pytest.fixture
def shifted(service):
    """Return a service whose latest check shows a zero shift of 12 N."""
    store_checks(service.client.app.state.context.catalogue, [*IN_CONTROL, 0.0, 12.0])
    return service


def test_without_checks_there_are_no_charts_and_the_method_fits_the_drive(service):
    charts = service.get("/checks/charts")
    assert charts == {"method": "zero_check", "specimen": "mounted damper", "items": []}
    chart = service.get("/checks/force/chart")
    assert (chart["state"], chart["text"]) == ("not_enough", "force: no zero check yet")
    assert service.get("/checks")["items"] == []


def test_a_bench_driven_by_current_has_its_own_method(service):
    service.agent.description = service.agent.description.model_copy(update={"drive_kind": "coil_a"})
    assert service.get("/checks/charts")["method"] == "zero_check_current"


def test_charts_need_no_agent(shifted):
    shifted.agent.reachable = False
    charts = shifted.get("/checks/charts")
    assert charts["method"] is None
    assert {one["series"]["channel"] for one in charts["items"]} == {"force", "displacement"}


def test_records_are_listed_with_units_the_newest_first(shifted):
    newest, *others = shifted.get("/checks?channel=force")["items"]
    assert len(others) == 21
    assert (newest["run"], newest["unit"], newest["instrument"]) == ("run-21", "N", "load_cell")
    assert newest["value"] == 12.0
    assert len(shifted.get("/checks?limit=3")["items"]) == 3
    assert shifted.client.get(f"{API}?channel=velocity").status_code == 422


def test_the_chart_has_limits_points_and_the_state_in_words(shifted):
    chart = shifted.get("/checks/force/chart")
    assert (chart["state"], chart["count"], chart["needed"], chart["unit"]) == ("out_of_control", 22, 20, "N")
    assert chart["limits"]["centre"] == 0
    # Moving range 2 N over 1.128.
    assert chart["limits"]["sigma"] == pytest.approx(2 / 1.128)
    assert "beyond_limits" in chart["points"][-1]["rules"]
    assert [one["is_baseline"] for one in chart["points"]] == [True] * 20 + [False] * 2
    assert shifted.get("/checks/force/chart?specimen=S-2")["points"] == []
    assert shifted.get(f"/checks/force/chart?specimen={MOUNTED}") == chart


def test_health_names_the_channel_that_is_out_of_control(shifted):
    assert "force: zero check of 2026-01-26" in shifted.get("/health")["calibration"]


def test_a_run_gets_the_latest_checks(shifted):
    shifted.post("/runs", {"method": "quick", "specimen": "A"}, status=201)
    checks = {one.channel: one for one in shifted.agent.commands[-1].checks}
    assert (checks["force"].state, checks["force"].run) == ("out_of_control", "run-21")
    assert checks["displacement"].state == "in_control"


def test_a_marked_run_says_so_in_its_view(service):
    service.agent.failed_checks = ("force: zero check is out of control",)
    run = service.post("/runs", {"method": "quick", "specimen": "A"}, status=201)
    assert run["failed_checks"] == ["force: zero check is out of control"]


def test_a_check_is_recorded_by_the_scan_and_not_identified(service):
    write_check_log(service.data / "check-1.mcap", "check-1", zero_n=8.0)
    service.scan()
    assert service.get("/runs/check-1")["jobs"] == []
    (record,) = service.get("/checks?channel=force")["items"]
    assert (record["run"], record["value"]) == ("check-1", pytest.approx(8.0, abs=0.35))


def test_a_new_baseline_needs_a_reason_and_clears_the_state(shifted):
    assert shifted.client.post(f"{API}/force/baseline", json={}).status_code == 422
    chart = shifted.post("/checks/force/baseline", {"reason": "load cell was replaced"}, status=201)
    assert (chart["state"], chart["count"]) == ("not_enough", 0)
    assert chart["since"] is not None
    assert shifted.get("/health")["calibration"] == "ok"
    assert len(shifted.get("/checks?channel=force")["items"]) == 22


@pytest.fixture
def both(shifted):
    """Return a service with zero checks, and one shunt check of 1000 N."""
    write_shunt_log(shifted.data / "shunt-1.mcap", "shunt-1")
    shifted.scan()
    return shifted


def test_shunt_checks_are_listed_and_charted_only_by_their_name(both):
    (record,) = both.get("/checks?check=shunt")["items"]
    assert (record["run"], record["check"], record["value"]) == (
        "shunt-1",
        "shunt",
        pytest.approx(1000.0, abs=0.5),
    )
    assert {one["check"] for one in both.get("/checks?limit=1000")["items"]} == {"zero"}
    chart = both.get("/checks/force/chart?check=shunt")
    assert (chart["series"]["check"], chart["count"]) == ("shunt", 1)
    assert chart["text"] == "force: shunt check: not enough checks, 1 of 20"
    assert both.get("/checks/force/chart")["count"] == 22
    assert both.client.get(f"{API}/force/chart?check=gain").status_code == 422
    assert both.get("/runs/shunt-1")["jobs"] == []


def test_the_charts_of_a_kind_have_its_method(both):
    charts = both.get("/checks/charts?check=shunt")
    assert charts["method"] == "shunt_check"
    assert [one["series"]["channel"] for one in charts["items"]] == ["force"]
    both.agent.description = both.agent.description.model_copy(update={"drive_kind": "coil_a"})
    assert both.get("/checks/charts?check=shunt")["method"] == "shunt_check_current"


def test_a_new_baseline_is_that_of_its_kind(both):
    request = {"reason": "amplifier was replaced", "check": "shunt"}
    assert both.post("/checks/force/baseline", request, status=201)["series"]["check"] == "shunt"
    assert both.get("/checks/force/chart?check=shunt")["count"] == 0
    assert both.get("/checks/force/chart")["count"] == 22


def test_a_run_gets_the_latest_check_of_each_kind(both):
    both.post("/runs", {"method": "quick", "specimen": "A"}, status=201)
    checks = {(one.channel, one.check): one.run for one in both.agent.commands[-1].checks}
    assert (checks["force", "zero"], checks["force", "shunt"]) == ("run-21", "shunt-1")

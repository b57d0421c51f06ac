"""Calibration certificates in the web page, in a real browser: list, form, correction, withdrawal, marks."""

import pytest

from tests.support.certificates import shift
from tests.support.fake_page_service import OVERDUE, FakeBench
from tests.support.page_in_browser import browser_test, operate_page


@pytest.fixture(scope="module")
def seen():
    """Return what a person sees who keeps the certificates."""
    return operate_page(FakeBench(), "use_certificates.mjs")


@browser_test
def test_the_list_has_its_address_and_the_most_urgent_certificates_first(seen):
    assert seen["errors"] == []
    assert (seen["address"], seen["focused"]) == ("#/calibration", "Calibration")
    channels = [text.split("\n")[0].split("\t")[0] for text in seen["list"]]
    assert channels == ["coil voltage", "displacement", "force", "force"]
    assert f"overdue since {shift(-35)}" in seen["list"][0]
    assert f"due on {shift(8)}, in 8 days" in seen["list"][1]
    assert "superseded" in seen["list"][3]


@browser_test
def test_quantities_have_their_units(seen):
    displacement = seen["list"][1]
    assert "0.004 %" in displacement
    assert "0.000004 m at k = 2" in displacement or "4.000e−6 m at k = 2" in displacement
    assert "2 points, 0 to 0.05 m" in displacement
    assert "Points: reference and indication [A], one pair on each line" in seen["labels"]
    assert "Uncertainty [%]" in seen["labels"]


@browser_test
def test_no_finding_of_axe_core_no_small_control_no_sideways_scroll(seen):
    assert {place: found for place, found in seen["findings"].items() if found} == {}


@browser_test
def test_a_wrong_certificate_is_refused_with_the_reason(seen):
    assert seen["firstField"] == "channel"
    assert "line 2 of the points has not two numbers" in seen["unreadable"]
    assert "reference 1 A of point 3 is not above 2 A of point 2" in seen["falling"]


@browser_test
def test_a_certificate_is_added_corrected_and_withdrawn(seen):
    assert "valid" in seen["added"]
    assert "0.05 %" in seen["added"]
    assert "0.1 %" in seen["added"]
    assert (seen["prefilled"], seen["percent"], seen["fixed"]) == ("-2 -2.002\n0 0\n2 2.002", "0.1", True)
    assert "version 2" in seen["corrected"]
    assert "typing error" in seen["corrected"]
    assert "2098-01-09" in seen["corrected"]
    assert "shunt was repaired" in seen["withdrawn"]


@browser_test
def test_the_health_strip_and_a_run_name_the_overdue_channel(seen):
    assert "coil voltage overdue since 2025-02-20" in seen["health"]
    assert "waiting for bench left" in seen["health"]
    assert "Log store ready" in " ".join(seen["health"].split())
    assert OVERDUE in seen["marked"]


@browser_test
def test_the_parameters_of_a_fit_have_an_interval_with_calibration(seen):
    head, *rows = seen["parameters"]
    assert "95 % interval with calibration" in head
    texts = {row.split("\t")[0]: row for row in rows}
    assert "no certificate of drive" in texts["alpha b"]
    plain, combined = ([float(number) for number in cell.split(" … ")] for cell in texts["k0"].split("\t")[2:4])
    assert combined[0] < plain[0] < plain[1] < combined[1]

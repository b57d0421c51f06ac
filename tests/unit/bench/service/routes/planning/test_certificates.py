"""Certificates over REST: immutable versions, withdrawal, state, and health in words."""

import pytest

from tests.support.certificates import make_certificate, shift

API = "/api/v1/certificates"


@pytest.fixture
def stored(service):
    return service.post("/certificates", make_certificate(), status=201)


def test_a_certificate_is_stored_with_state_gain_and_author(service, stored):
    assert (stored["version"], stored["state"], stored["due_text"]) == (1, "valid", "")
    assert (stored["created_by"], stored["reason"], stored["withdrawal"]) == ("bench", "", None)
    assert stored["gain_error"] == pytest.approx(0.003)
    assert stored["gain_standard_uncertainty"] == pytest.approx(0.002)
    assert stored["document"] == make_certificate()
    assert service.get("/certificates")["items"] == [stored]
    assert service.get(f"/certificates/{stored['id']}") == stored


def test_the_same_number_is_refused(service, stored):
    problem = service.post("/certificates", make_certificate(note="again"), status=409)
    assert "correct it with PATCH" in problem["detail"]
    assert problem["type"] == "urn:mrbench:problem:certificate-stored"


def test_a_correction_is_a_new_version_and_the_former_one_stays(service, stored):
    path = f"{API}/{stored['id']}"
    uncertainty = {"value": 2.0, "kind": "absolute", "coverage_factor": 2}
    changes = {"reason": "typing error", "uncertainty": uncertainty}
    corrected = service.client.patch(path, json=changes).json()
    assert (corrected["version"], corrected["reason"]) == (2, "typing error")
    assert corrected["document"] == make_certificate(uncertainty=uncertainty)
    assert service.get(f"/certificates/{stored['id']}?version=1")["document"] == stored["document"]
    versions = service.get(f"/certificates/{stored['id']}/versions")["items"]
    assert [one["version"] for one in versions] == [1, 2]
    assert [one["version"] for one in service.get("/certificates")["items"]] == [2]


def test_a_wrong_correction_is_refused_and_changes_nothing(service, stored):
    answer = service.client.patch(f"{API}/{stored['id']}", json={"reason": "x", "due": "1990-01-01"})
    assert answer.status_code == 422
    assert "before the date of calibration" in answer.json()["detail"]
    assert service.get(f"/certificates/{stored['id']}") == stored


def test_a_correction_needs_a_reason(service, stored):
    assert service.client.patch(f"{API}/{stored['id']}", json={"note": "x"}).status_code == 422


def test_a_withdrawn_certificate_stays_visible_and_applies_no_longer(service, stored):
    path = f"{API}/{stored['id']}"
    withdrawn = service.client.delete(path, params={"reason": "cell was dropped"}).json()
    assert (withdrawn["state"], withdrawn["withdrawal"]["reason"]) == ("withdrawn", "cell was dropped")
    assert service.get("/certificates")["items"] == [withdrawn]
    again = service.client.delete(path, params={"reason": "again"})
    assert (again.status_code, "cell was dropped" in again.json()["detail"]) == (409, True)
    assert service.client.patch(path, json={"reason": "x", "note": "y"}).status_code == 409


def test_a_withdrawal_needs_a_reason(service, stored):
    assert service.client.delete(f"{API}/{stored['id']}").status_code == 422


def test_a_newer_calibration_supersedes_the_former_until_it_is_withdrawn(service, stored):
    new = make_certificate(number="4712", date=shift(-1), due=shift(364))
    newer = service.post("/certificates", new, status=201)
    states = {one["id"]: one["state"] for one in service.get("/certificates?channel=force")["items"]}
    assert states == {stored["id"]: "superseded", newer["id"]: "valid"}
    service.client.delete(f"{API}/{newer['id']}", params={"reason": "wrong cell"})
    assert service.get(f"/certificates/{stored['id']}")["state"] == "valid"


def test_certificates_of_one_channel_are_listed(service, stored):
    assert service.get("/certificates?channel=coil_current")["items"] == []
    assert service.client.get(f"{API}?channel=velocity").status_code == 422


def test_an_unknown_certificate_or_version_is_not_found(service, stored):
    assert service.client.get(f"{API}/nothing").status_code == 404
    assert service.client.get(f"{API}/{stored['id']}?version=2").status_code == 404


def test_an_invalid_certificate_is_refused_in_words(service):
    problem = service.post("/certificates", make_certificate(unit="kN"), status=422)
    assert "convert points and uncertainty to N" in problem["detail"]


def test_health_names_overdue_and_soon_due_channels(service, stored):
    assert service.get("/health")["calibration"] == "ok"
    overdue = make_certificate(number="4712", date=shift(-30), due=shift(-1))
    service.post("/certificates", overdue, status=201)
    soon = make_certificate("displacement", "m", date=shift(-30), due=shift(9))
    service.post("/certificates", soon, status=201)
    assert service.get("/health")["calibration"] == (
        f"force: calibration overdue since {shift(-1)} (certificate 4712 of PTB Braunschweig); "
        f"displacement: calibration due on {shift(9)}, in 9 days (certificate 4711 of PTB Braunschweig)"
    )

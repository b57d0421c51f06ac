"""Campaigns of a script, on a service with a rig agent under the control of the test."""

import pytest

from bench.client import ClientError
from bench.service.routes.planning import assessments

REST = {"rest": {"seconds": 900}}
PROMPT = {"prompt": {"text": "Mount the specimen", "note": True}}
PHOTO = b"\xff\xd8\xff\xe0 a photo"


def test_a_script_adds_a_photo_to_its_answer_and_downloads_it(bench, tmp_path):
    campaign = bench.start_campaign({"name": "night", "steps": [PROMPT, REST]})
    assert campaign.wait(20)["question"]["item"] == "s0001"
    with pytest.raises(ClientError, match="photo of step s0001"):
        campaign.download_photo("s0001", tmp_path / "none.jpg")
    (tmp_path / "given.jpg").write_bytes(PHOTO)
    campaign.answer("12 N m", photo=tmp_path / "given.jpg")
    assert campaign.download_photo("s0001", tmp_path / "photo.jpg").read_bytes() == PHOTO


def test_a_script_makes_the_dry_run_of_a_campaign(bench, monkeypatch):
    design = {"messages": ["k0 to 3 %"]}
    monkeypatch.setattr(
        "bench.service.routes.planning.assessments.assess_design", lambda programme, command: design
    )
    assessments._assess.cache_clear()
    document = {"name": "night", "steps": [REST, {"run": {"specimen": "MR-1", "method": "quick"}}]}
    (quick,) = bench.plan_campaign(document, identifiability=False)["methods"]
    assert quick["identifiability"] == []
    plan = bench.plan_campaign(document)
    assert plan["methods"][0]["identifiability"] == ["k0 to 3 %"]
    assert plan["duration_s"] == pytest.approx(923.1)
    assessments._assess.cache_clear()


def test_a_script_starts_edits_answers_and_stops_a_campaign(bench, tmp_path):
    campaign = bench.start_campaign({"name": "night", "steps": [PROMPT, REST]}, "M. Curie")
    assert campaign.wait(20)["question"]["text"] == "Mount the specimen"
    with pytest.raises(ClientError, match="needs a note"):
        campaign.answer()
    campaign.answer("12 N m", who="B")
    assert campaign.edit({"edit": "add", "steps": [REST]}, "B")["items"][2]["state"] == "pending"
    assert bench.find_campaign().id == campaign.id
    with pytest.raises(ClientError, match="no recipients"):
        campaign.send_test_message()
    assert campaign.pause("B")["status"] == "paused"
    assert campaign.resume("B")["status"] == "running"
    assert campaign.stop("B")["status"] == "stopped"
    assert campaign.download_report(tmp_path / "report.pdf", "pdf").read_bytes().startswith(b"%PDF-")
    with pytest.raises(ClientError, match="format"):
        campaign.download_report(tmp_path / "report.doc", "doc")
    assert [one["id"] for one in bench.list_campaigns()] == [campaign.id]
    assert bench.find_campaign() is None
    with pytest.raises(ClientError, match="no recipients"):
        bench.send_test_message({"name": "night", "steps": [REST]})
    with pytest.raises(ClientError, match="at least one step"):
        bench.start_campaign({"name": "night", "steps": []})

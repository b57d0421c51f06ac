"""Campaigns in the web page, in a real browser: list, board, answers, edits, messages and start."""

import re

import pytest

from bench.campaigns import CampaignView
from tests.support.fake_campaigns import RESULT, UNAPPROVED, FakeCampaigns
from tests.support.fake_page_service import FakeBench
from tests.support.page_in_browser import browser_test, operate_page


@pytest.fixture(scope="module")
def seen():
    """Return what a person sees who follows, answers, edits, stops and starts campaigns."""
    return operate_page(FakeBench(), "use_campaigns.mjs")


def test_the_documents_of_the_fake_service_are_those_of_the_service():
    for one in FakeCampaigns().known.values():
        document = one.view().model_dump(mode="json")
        assert CampaignView.model_validate(document).id == one.id


@browser_test
def test_a_campaign_that_requires_approved_methods_says_which_one_is_not(seen):
    assert seen["unapproved"] == f"Not started: {UNAPPROVED}."


@browser_test
def test_no_view_has_a_finding_of_axe_core_a_small_control_or_a_sideways_scroll(seen):
    assert seen["errors"] == []
    assert {view: found for view, found in seen["violations"].items() if found} == {}
    assert {view: found for view, found in seen["small"].items() if found} == {}
    assert {view: width for view, width in seen["overflow"].items() if width > 0} == {}


@browser_test
def test_the_keyboard_reaches_a_campaign_from_the_navigation(seen):
    assert seen["focusedTitle"] == "Campaigns"
    assert seen["walked"] == "#/campaigns/night-1"
    night, short = seen["list"]
    assert "A person is needed." in night
    assert "15 of 27 done" in night
    assert "stopped on request" in short


@browser_test
def test_the_board_shows_steps_expected_end_and_net_times_with_their_units(seen):
    facts = seen["facts"]
    assert "s0019: Mount the next specimen" in facts
    assert "waits for a person" in facts
    assert re.search(r"Expected end\s+2025-03-0\d \d\d:\d\d:\d\d UTC", facts)
    assert re.search(r"Time in motion\s+48 min 11 s", facts)
    assert re.search(r"Time at rest\s+1 h 00 min", facts)
    assert re.search(r"Time held\s+21 min 34 s", facts)
    assert "27.3 °C" in facts


@browser_test
def test_each_cell_of_the_matrix_shows_its_states_by_shape_and_word_and_links_to_its_runs(seen):
    assert [row.split()[0] for row in seen["matrix"]] == ["MR-0042", "MR-0043", "MR-0044"]
    assert "failed" in seen["matrix"][0]
    assert "displacement 26.4 mm is above the limit of 26.25 mm" in seen["matrix"][0]
    assert "2 crashes of the bench" in seen["matrix"][1]
    assert seen["matrix"][2].count("pending") == 8
    assert "drive 0.3 V" in seen["heads"]
    assert len(set(seen["shapes"].values())) == 6
    assert re.fullmatch(r"#/runs/run-\d", seen["runLink"])


@browser_test
def test_trends_have_a_table_with_intervals(seen):
    assert "k0 [N/m]" in seen["trend"]
    assert "2630" in seen["trend"]
    assert "± 40" in seen["trend"]


@browser_test
def test_messages_tell_what_was_sent_what_is_tried_again_and_what_has_failed(seen):
    assert "Sent to night@example.org" in seen["messages"][0]
    assert re.search(r"Attempt 2 follows at .* UTC.*connection was refused", seen["messages"][0])
    assert "Not sent after 5 attempts" in seen["endedMessages"]
    assert seen["test"] == RESULT


@browser_test
def test_an_answer_needs_its_note_keeps_what_was_typed_and_sends_note_and_photo(seen):
    assert seen["refusedBefore"] == 0
    assert seen["typed"] == "torque 12 N m"
    method, path, body = seen["sent"][0]
    assert (method, path) == ("POST", "campaigns/night-1/answer")
    assert body["photo"] == "iVBORyBhIHBob3Rv"
    assert {name: body[name] for name in ("who", "note", "choice")} == {
        "who": "A. Meyer",
        "note": "torque 12 N m",
        "choice": None,
    }
    assert seen["questionIsGone"]


@browser_test
def test_the_photo_of_an_answer_is_saved_from_the_queue(seen):
    assert seen["photo"] == "photo.jpg"


@browser_test
def test_the_queue_is_edited_with_the_name_of_the_person(seen):
    edits = [body for method, _, body in seen["sent"] if method == "PATCH"]
    assert {one["who"] for one in edits} == {"A. Meyer"}
    assert [one["edit"]["edit"] for one in edits] == ["move", "pause", "delete", "do_now", "add", "add", "release"]
    assert seen["focusStays"].startswith("Earlier: step s0022")
    assert "Not edited: step s0020" in seen["refusedNow"]
    assert "between two runs" in seen["refusedNow"]
    assert seen["queue"] == [
        "s0013",
        "s0020",
        "s0022",
        "s0021",
        "s0028",
        "s0023",
        "s0025",
        "s0026",
        "s0027",
        "s0029",
        "s0030",
    ]
    assert edits[-2]["edit"]["steps"] == [{"setup": {"step": "move", "position_m": 0.0125}}]
    assert not seen["hasPosition"]


@browser_test
def test_the_report_is_saved_as_page_or_pdf_and_a_refusal_is_named(seen):
    assert seen["reports"] == [
        [f"night-1.report.{one}", f"report as {one}", f"night-1.report.{one} was saved."]
        for one in ("html", "pdf")
    ]
    assert "the disk is full" in seen["refusedReport"]


@browser_test
def test_stop_of_the_bench_stays_usable_while_a_command_is_confirmed(seen):
    assert seen["stopped"].endswith("/stop")
    assert "campaigns" not in seen["stopped"]
    assert seen["dialogStays"]
    assert seen["dialogLeft"]


@browser_test
def test_pause_resume_and_stop_are_confirmed_and_sent(seen):
    sent = [(path.rpartition("/")[2], body) for _, path, body in seen["sent"]]
    assert ("pause", {"who": "A. Meyer"}) in sent
    assert ("resume", {"who": "A. Meyer"}) in sent
    assert ("stop", {"who": "A. Meyer", "now": True}) in sent
    assert seen["focusAfterResume"] == "stop"
    assert not seen["canStopAgain"]


@browser_test
def test_a_campaign_is_started_after_its_dry_run(seen):
    assert "a campaign needs at least one step" in seen["refusedPlan"]
    assert not seen["startsWithoutPlan"]
    assert seen["startsAfterTest"]
    for part in ("Expected time", "kJ", "the disk has 42 GB free", "within limits", "2. rest 600 s", "k0 to 3 %"):
        assert part in seen["plan"]
    assert seen["begun"] == ["#/campaigns/morning-1", "stop"]


@browser_test
def test_an_ended_campaign_offers_no_command_and_the_list_has_its_title_again(seen):
    assert seen["endedControls"] == [True, True, True]
    assert seen["titleOfList"] == "Campaigns"

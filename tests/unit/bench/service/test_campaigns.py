"""Campaigns by the REST interface, executed on a rig agent under the control of the test."""

import base64
import time
from contextlib import suppress

import pytest

from bench import cli
from bench.agent_protocol import BenchLimit, InstrumentStatus, PauseCommand, PrepareCommand, RunCommand
from bench.campaigns import CampaignStore, collect_methods, parse_campaign
from bench.service.routes.planning import assessments
from tests.support.certificates import make_certificate
from tests.support.message_servers import find_closed_port, serve_webhook
from tests.support.service_logs import write_complete_log

RUN = {"run": {"specimen": "MR-1", "method": "quick"}}
REPEAT = {"repeat": {"step": RUN, "until": {"parameter": "k0", "ci_percent": 2}, "at_most": 3}}
PROMPT = {"prompt": {"text": "Mount the next specimen", "note": True, "photo": True}}
COOL = {"rest": {"until_temperature_c": 25}}
PHOTO = base64.b64encode(b"\xff\xd8\xff\xe0 a photo").decode()


@pytest.fixture(autouse=True)
def fast(monkeypatch):
    monkeypatch.setattr("bench.service.campaigns.executor.PERIOD", 0.02)


def start(service, steps, status=201, **more):
    body = {"campaign": {"name": "night", "steps": steps, **more}, "operator": "M. Curie"}
    return service.post("/campaigns", body, status)


def wait(service, campaign, wanted):
    return service.wait_for(f"/campaigns/{campaign['id']}", wanted)


def finish(service, outcome="clean", ending="completed"):
    """End the run of the agent, with its log."""
    run = service.agent.status.run
    write_complete_log(service.data / run.log.rpartition("/")[2], run.id, outcome)
    service.agent.finish(outcome, ending=ending)


def wait_for_command(service, kind, number=1):
    deadline = time.monotonic() + 20
    while len(found := [one for one in service.agent.commands if isinstance(one, kind)]) < number:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    return found[number - 1]


def test_a_campaign_is_executed_answered_and_listed(service):
    stored = service.post("/certificates", make_certificate(), 201)
    campaign = start(service, [RUN, PROMPT, RUN])
    command = wait_for_command(service, RunCommand)
    assert [one.id for one in command.certificates] == [stored["id"]]
    assert (command.specimen, command.operator) == ("MR-1", "M. Curie")
    wait(service, campaign, lambda found: found["phase"] == "stroking")
    assert service.get("/queue")["campaign"]["id"] == campaign["id"]
    finish(service)
    asked = wait(service, campaign, lambda found: found["question"])
    assert asked["question"]["text"] == "Mount the next specimen"
    path = f"/campaigns/{campaign['id']}/answer"
    assert "needs a note" in service.post(path, {"photo": PHOTO}, 409)["detail"]
    assert "neither JPEG nor PNG" in service.post(path, {"note": "x", "photo": "AAAA"}, 409)["detail"]
    answered = service.post(path, {"who": "B", "note": "12 N m", "photo": PHOTO})
    assert answered["items"][1]["note"] == "12 N m"
    assert (service.data / answered["items"][1]["photo"]).read_bytes().startswith(b"\xff\xd8\xff")
    wait_for_command(service, RunCommand, 2)
    finish(service)
    ended = wait(service, campaign, lambda found: found["status"] == "done")
    assert [item["state"] for item in ended["items"]] == ["done"] * 3
    assert ended["cells"][0]["runs"] == ["run-1", "run-2"]
    assert any(event["who"] == "B" for event in ended["events"])
    listed = service.get("/campaigns")["items"]
    assert [(one["id"], one["done"]) for one in listed] == [(campaign["id"], 3)]
    assert service.get("/queue") == {"campaign": None}


def test_a_pause_ends_the_run_at_its_checkpoint_and_the_rest_is_continued(service):
    campaign = start(service, [RUN])
    wait(service, campaign, lambda found: found["phase"] == "stroking")
    path = f"/campaigns/{campaign['id']}"
    assert service.post(f"{path}/pause", {"who": "B"})["status"] == "pausing"
    wait_for_command(service, PauseCommand)
    finish(service, "incomplete", "stopped")
    wait(service, campaign, lambda found: found["status"] == "paused")
    service.post(f"{path}/resume", {"who": "B"})
    assert wait_for_command(service, RunCommand, 2).continues == "run-1"
    service.post(f"{path}/stop", {"who": "B"})
    finish(service)
    stopped = wait(service, campaign, lambda found: found["status"] == "stopped")
    assert stopped["items"][0]["parts"] == ["run-1"]


def test_a_campaign_holds_the_bench_until_it_needs_a_person(service):
    assert service.get("/bench/lease")["holder"] is None
    campaign = start(service, [{"rest": {"seconds": 600}}, PROMPT])
    held = service.wait_for("/bench/lease", lambda lease: lease["holder"] == "campaign")
    assert (held["id"], f"campaign {campaign['id']} of M. Curie holds the bench" in held["description"]) == (
        campaign["id"],
        True,
    )
    body = {"method": "quick", "specimen": "MR-9"}
    for path, sent in (("/runs", body), ("/bench/prepare", {"step": "tare"})):
        refusal = service.post(path, sent, 409)
        assert f"campaign {campaign['id']} of M. Curie holds the bench" in refusal["detail"]
        assert "pause or stop it" in refusal["detail"]
    service.post(f"/campaigns/{campaign['id']}/pause", {})
    wait(service, campaign, lambda found: found["status"] == "paused")
    service.wait_for("/bench/lease", lambda lease: lease["holder"] is None)
    service.post("/bench/prepare", {"step": "tare"})
    service.post(f"/campaigns/{campaign['id']}/resume", {})
    service.wait_for("/bench/lease", lambda lease: lease["holder"] == "campaign")
    service.post(f"/campaigns/{campaign['id']}/stop", {})
    wait(service, campaign, lambda found: found["status"] == "stopped")
    service.wait_for("/bench/lease", lambda lease: lease["holder"] is None)


def test_a_person_uses_the_bench_while_a_campaign_asks(service):
    campaign = start(service, [PROMPT, RUN])
    wait(service, campaign, lambda found: found["question"])
    service.wait_for("/bench/lease", lambda lease: lease["holder"] is None)
    service.post("/bench/prepare", {"step": "tare"})
    service.post(f"/campaigns/{campaign['id']}/answer", {"note": "mounted", "photo": PHOTO})
    wait_for_command(service, RunCommand)
    service.wait_for("/bench/lease", lambda lease: lease["holder"] == "campaign")


def test_a_restarted_service_continues_and_repeats_no_finished_run(service):
    campaign = start(service, [RUN, RUN])
    wait(service, campaign, lambda found: found["phase"] == "stroking")
    service.end()
    finish(service)
    service.start()
    wait_for_command(service, RunCommand, 2)
    finish(service)
    done = wait(service, campaign, lambda found: found["status"] == "done")
    assert [item["runs"] for item in done["items"]] == [["run-1"], ["run-2"]]


def test_the_queue_is_edited_while_a_run_is_in_progress(service):
    campaign = start(service, [RUN, RUN])
    wait(service, campaign, lambda found: found["phase"] == "stroking")
    path = f"/api/v1/campaigns/{campaign['id']}"

    def edit(status, address=path, **given):
        answer = service.client.patch(address, json={"who": "B", "edit": given})
        assert answer.status_code == status, answer.text
        return answer.json()

    added = edit(200, edit="add", steps=[{"rest": {"seconds": 5}}], before="s0002")
    assert [item["id"] for item in added["items"]] == ["s0001", "s0003", "s0002"]
    assert "between two runs" in edit(409, edit="do_now", step={"rest": {"seconds": 5}})["detail"]
    assert "s0001 is active" in edit(409, edit="delete", item="s0001")["detail"]
    edit(200, "/api/v1/queue", edit="move", item="s0002", position=0)
    paused = edit(200, "/api/v1/queue", edit="pause", before="s0003", text="Check the clevis")
    assert [item["id"] for item in paused["items"]] == ["s0001", "s0002", "s0004", "s0003"]
    deleted = edit(200, "/api/v1/queue", edit="delete", item="s0002")
    assert deleted["items"][1]["state"] == "skipped"
    kept = [event for event in service.get(path.removeprefix("/api/v1"))["events"] if event["kind"] == "edit"]
    assert [(event["who"], event["text"].split()[0]) for event in kept] == [
        ("B", "added"), ("B", "moved"), ("B", "added"), ("B", "deleted"),
    ]  # fmt: skip
    assert all(event["at"] for event in kept)
    edit(422, edit="hope")
    assert service.post("/campaigns", {"campaign": {"name": "b", "steps": [RUN]}}, 409)["type"].endswith("held")


def test_an_edit_that_is_repeated_with_its_key_adds_one_step(service):
    campaign = start(service, [{"rest": {"seconds": 500}}])
    edit = {"who": "B", "edit": {"edit": "add", "steps": [{"rest": {"seconds": 5}}]}}
    for path in (f"/api/v1/campaigns/{campaign['id']}", "/api/v1/queue"):
        key = {"Idempotency-Key": path}
        before = len(service.get(f"/campaigns/{campaign['id']}")["items"])
        first, second = (service.client.patch(path, json=edit, headers=key) for _ in range(2))
        assert first.json() == second.json()
        assert len(first.json()["items"]) == before + 1
        assert second.headers["Idempotency-Replayed"] == "true"
        assert len(service.get(f"/campaigns/{campaign['id']}")["items"]) == before + 1


def test_a_repeated_answer_does_not_answer_the_next_question(service):
    campaign = start(service, [PROMPT, PROMPT])
    wait(service, campaign, lambda found: found["question"] is not None)
    path, key = f"/api/v1/campaigns/{campaign['id']}/answer", {"Idempotency-Key": "answer-1"}
    body = {"note": "torque 12 N m", "photo": PHOTO}
    assert service.client.post(path, json=body, headers=key).status_code == 200
    wait(service, campaign, lambda found: found["question"] and found["question"]["item"] == "s0002")
    assert service.client.post(path, json=body, headers=key).headers["Idempotency-Replayed"] == "true"
    assert service.get(f"/campaigns/{campaign['id']}")["question"]["item"] == "s0002"


def test_the_photo_of_an_answer_is_returned_as_it_was_sent(service):
    campaign = start(service, [PROMPT, {"rest": {"seconds": 500}}])
    wait(service, campaign, lambda found: found["question"] is not None)
    path = f"/api/v1/campaigns/{campaign['id']}"
    assert service.client.get(f"{path}/photos/s0001").status_code == 404
    service.post(f"/campaigns/{campaign['id']}/answer", {"note": "done", "photo": PHOTO})
    answer = service.client.get(f"{path}/photos/s0001")
    assert answer.content == base64.b64decode(PHOTO)
    assert answer.headers["content-type"] == "image/jpeg"
    for item in ("s0002", "..%2Fcatalogue.db"):
        assert service.client.get(f"{path}/photos/{item}").status_code == 404
    assert service.client.get("/api/v1/campaigns/none/photos/s0001").status_code == 404


@pytest.mark.parametrize(
    ("steps", "more", "status", "reason"),
    [
        ([], {}, 422, "at least one step"),
        ([{"run": {"specimen": "a", "method": "nonsense"}}], {}, 422, "there is no method nonsense"),
        ([COOL, RUN], {}, 409, "no thermometer"),
        ([RUN], {"methods": "approved"}, 409, "not approved: "),
    ],
)
def test_a_campaign_that_cannot_be_met_is_refused_at_the_start(service, steps, more, status, reason):
    assert reason in start(service, steps, status, **more)["detail"]
    assert service.get("/campaigns")["items"] == []


def test_a_condition_on_results_needs_a_worker(service):
    service.engine.state = "no worker is connected"
    assert "no worker is connected" in start(service, [REPEAT], 409)["detail"]


def test_an_edit_whose_condition_needs_a_worker_is_refused_without_one(service):
    campaign = start(service, [PROMPT], stop_on=[{"drift": {"parameter": "k0", "percent": 5}}])
    service.engine.state = "no worker is connected"
    path = f"/api/v1/campaigns/{campaign['id']}"

    def add(step):
        return service.client.patch(path, json={"edit": {"edit": "add", "steps": [step]}})

    refused = add(REPEAT)
    assert refused.status_code == 409
    assert "no worker is connected" in refused.json()["detail"]
    assert len(service.get(f"/campaigns/{campaign['id']}")["items"]) == 1
    # The conditions that stop the campaign were checked at its start.
    assert add(RUN).status_code == 200
    service.engine.state = "ok"
    assert add(REPEAT).status_code == 200


def create_on_command_line(service, steps, **more):
    """Store a campaign without the checks of the service, as another process may."""
    document = parse_campaign({"name": "night", "steps": steps, **more}, "the test")
    store = CampaignStore(service.client.app.state.context.catalogue)
    return store.create(document, collect_methods(document), "agent", time.time())


def test_a_campaign_without_its_worker_ends_with_that_reason(service, monkeypatch):
    monkeypatch.setattr("bench.service.campaigns.executor.WORKER_TIME", 0.0)
    service.engine.state = "no worker; start one: mrbench worker"
    campaign = create_on_command_line(service, [RUN, REPEAT])
    ended = wait(service, {"id": campaign.id}, lambda found: found["status"] == "stopped")
    assert "no worker; start one" in ended["reason"]
    assert not [one for one in service.agent.commands if isinstance(one, RunCommand)]


def test_a_worker_may_connect_after_the_start_of_the_service(service):
    service.engine.state = "no worker; start one: mrbench worker"
    campaign = create_on_command_line(service, [REPEAT])
    time.sleep(0.2)  # some looks of the executor
    assert service.get(f"/campaigns/{campaign.id}")["status"] == "running"
    assert not [one for one in service.agent.commands if isinstance(one, RunCommand)]
    service.engine.state = "ok"
    wait_for_command(service, RunCommand)


def test_a_campaign_whose_methods_are_not_approved_ends_with_that_reason(service):
    campaign = create_on_command_line(service, [RUN], methods="approved")
    ended = wait(service, {"id": campaign.id}, lambda found: found["status"] == "stopped")
    assert "not approved: quick" in ended["reason"]


def test_a_thermometer_makes_a_condition_on_the_temperature_possible(service):
    one = InstrumentStatus(
        name="thermometer", driver="thermometer", address="", connected=True, received=1, lost=0, corrupted=0,
        resynchronised=0, age_s=0.1, clock_error_bound_s=None, message="",
    )  # fmt: skip
    service.agent.status = service.agent.status.model_copy(update={"instruments": (one,)})
    campaign = start(service, [COOL])
    wait(service, campaign, lambda found: found["phase"] == "resting")
    assert service.post(f"/campaigns/{campaign['id']}/stop", {})["status"] == "stopped"


def test_a_plan_starts_nothing(service):
    plan = make_plan(service, [RUN, RUN], identifiability=False)
    assert plan["stroking_s"] == pytest.approx(46.2)
    assert (plan["problems"], plan["bench_unknown"], plan["methods"][0]["identifiability"]) == ([], "", [])
    assert service.get("/campaigns")["items"] == []


def make_plan(service, steps, **more):
    return service.post("/campaigns/plan", {"campaign": {"name": "night", "steps": steps}, **more})


def test_a_plan_says_what_each_method_can_identify_and_assesses_equal_ones_once(service, monkeypatch):
    assessed = []

    def assess(programme, command):
        assessed.append(programme.method.name)
        return {"messages": [f"{len(assessed)}. k0 to 3 %"]}

    monkeypatch.setattr("bench.service.routes.planning.assessments.assess_design", assess)
    assessments._assess.cache_clear()
    steps = [RUN, RUN, {"run": {**RUN["run"], "drive": 0.2}}]
    plans = [make_plan(service, steps) for _ in range(2)]
    assert [one["identifiability"] for one in plans[0]["methods"]] == [["1. k0 to 3 %"], ["2. k0 to 3 %"]]
    assert plans[0]["methods"] == plans[1]["methods"]
    assert len(assessed) == 2
    assessments._assess.cache_clear()


def set_limit(service, quantity, value):
    """Set the value at which the bench stops."""
    limit = BenchLimit(unit="", indicate=None, hold=None, controlled_stop=value, trip=None)
    service.agent.description = service.agent.description.model_copy(update={"limits": {quantity: limit}})


def test_a_force_that_only_a_typical_damper_has_is_remarked_on_and_refuses_nothing(service):
    set_limit(service, "force", 300.0)
    plan = make_plan(service, [RUN], identifiability=False)
    assert plan["methods"][0]["remarks"] == ["force 647.9 N exceeds the bench's 300 N"]
    assert (plan["problems"], plan["methods"][0]["obstacles"]) == ([], [])
    start(service, [RUN])


def test_a_step_that_exceeds_the_bench_is_refused_before_the_start(service):
    set_limit(service, "displacement", 4e-3)
    plan = make_plan(service, [RUN], identifiability=False)
    (excess,) = plan["methods"][0]["obstacles"]
    assert excess.startswith("displacement ")
    assert excess.endswith(" mm exceeds the bench's 4 mm")
    problem = f"method quick: {excess}"
    assert plan["problems"] == [problem]
    assert problem in start(service, [RUN], 409)["detail"]
    campaign = create_on_command_line(service, [RUN])
    ended = wait(service, {"id": campaign.id}, lambda found: found["status"] == "stopped")
    assert problem in ended["reason"]
    set_limit(service, "displacement", 0.05)
    start(service, [RUN])


def test_a_method_for_another_drive_is_refused_before_the_start(service):
    service.agent.description = service.agent.description.model_copy(update={"drive_kind": "coil_a"})
    problem = "method quick: the method sets the coil voltage, this bench the coil current"
    assert make_plan(service, [RUN], identifiability=False)["problems"] == [problem]
    assert problem in start(service, [RUN], 409)["detail"]


def test_logs_that_do_not_fit_on_the_disk_are_refused_before_the_start(service, monkeypatch):
    for user in ("routes.campaigns.routes", "campaigns.executor"):
        monkeypatch.setattr(f"bench.service.{user}.find_usable_space", lambda folder: 1000)
    assert "0.000 GB are free" in make_plan(service, [RUN], identifiability=False)["problems"][0]
    assert "0.000 GB are free" in start(service, [RUN], 409)["detail"]


def test_a_plan_without_an_agent_says_that_the_bench_is_not_known(service):
    service.agent.reachable = False
    plan = make_plan(service, [RUN], identifiability=False)
    assert plan["bench_unknown"].startswith("no rig agent answered")
    assert plan["problems"] == []
    assert "no bench far" in service.post("/campaigns/plan", {"campaign": {"name": "n", "steps": [RUN]},
                                          "bench": "far"}, 404)["detail"]  # fmt: skip


def test_a_campaign_runs_the_stored_version_and_keeps_it(service):
    titles = ["second version", "third version"]
    document = service.get("/methods/quick")
    service.post("/methods", document | {"title": titles[0]}, 201)
    campaign = start(service, [RUN, RUN])
    service.post("/methods", document | {"title": titles[1]}, 201)
    assert wait_for_command(service, RunCommand).method["title"] == titles[0]
    finish(service)
    assert wait_for_command(service, RunCommand, 2).method["title"] == titles[0]
    edit = {"edit": "add", "steps": [{"run": {**RUN["run"], "method_version": 3}}]}
    answer = service.client.patch(f"/api/v1/campaigns/{campaign['id']}", json={"edit": edit})
    assert "another method or version quick" in answer.json()["detail"]


def test_a_campaign_runs_the_version_that_it_names(service):
    service.post("/methods", service.get("/methods/quick") | {"title": "second version"}, 201)
    start(service, [{"run": {**RUN["run"], "method_version": 1}}])
    assert wait_for_command(service, RunCommand).method == service.get("/methods/quick/1")


def test_unknown_campaigns_and_missing_recipients_are_told(service):
    assert service.client.get("/api/v1/campaigns/none").status_code == 404
    service.post("/campaigns/none/pause", {}, 404)
    assert service.client.get("/api/v1/campaigns?before=none").status_code == 404
    campaign = start(service, [{"rest": {"seconds": 500}}])
    assert "no recipients" in service.post(f"/campaigns/{campaign['id']}/test-message", {}, 409)["detail"]


def test_the_recipients_of_a_document_are_tried_before_it_is_started(service):
    with serve_webhook() as (address, received):
        document = {"name": "night", "steps": [RUN], "notify": [{"webhook": address}]}
        assert service.post("/campaigns/test-message", {"campaign": document}) == {"result": "sent"}
    assert (received[0]["campaign"], received[0]["kind"]) == ("night", "test")
    service.post("/campaigns/test-message", {"campaign": document | {"steps": []}}, 422)
    without = service.post("/campaigns/test-message", {"campaign": document | {"notify": []}}, 409)
    assert "no recipients" in without["detail"]
    assert service.get("/campaigns")["items"] == []


def test_a_message_that_cannot_be_sent_is_shown_and_stops_nothing(service):
    refused = {"webhook": f"http://127.0.0.1:{find_closed_port()}/"}
    with serve_webhook() as (address, received):
        campaign = start(service, [PROMPT, RUN], notify=[refused, {"webhook": address}])
        told = wait(service, campaign, lambda found: found["question"] and list_messages(found, "sent"))
        assert received[0]["text"] == "Mount the next specimen"
        result = service.post(f"/campaigns/{campaign['id']}/test-message")["result"]
        assert "the connection was refused" in result
        assert received[-1]["kind"] == "test"
    (due,) = list_messages(told, "due")
    assert (due["attempts"], "the connection was refused" in due["reason"]) == (1, True)
    service.post(f"/campaigns/{campaign['id']}/answer", {"note": "done", "photo": PHOTO})
    wait(service, campaign, lambda found: found["phase"] == "stroking")


@pytest.mark.parametrize(
    ("query", "ending", "beginning"), [("", "html", b"<!doctype html>"), ("?format=pdf", "pdf", b"%PDF-")]
)
def test_the_report_of_a_campaign_in_progress_is_a_page_or_a_pdf(service, monkeypatch, query, ending, beginning):
    def run_here(arguments, error):
        with suppress(SystemExit):
            cli.main(arguments)

    monkeypatch.setattr("bench.service.routes.campaigns.reports.run_command", run_here)
    campaign = start(service, [PROMPT, RUN])
    answer = service.client.get(f"/api/v1/campaigns/{campaign['id']}/report{query}")
    assert answer.status_code == 200, answer.text
    assert answer.content.startswith(beginning)
    assert answer.headers["content-disposition"] == f'inline; filename="{campaign["id"]}.report.{ending}"'
    assert list(service.data.glob(".transfer-*")) == []


def test_a_report_of_an_unknown_campaign_or_in_another_format_is_refused(service):
    campaign = start(service, [PROMPT])
    unknown = service.client.get("/api/v1/campaigns/none/report")
    assert (unknown.status_code, unknown.json()["type"]) == (404, "urn:mrbench:problem:not-found")
    other = service.client.get(f"/api/v1/campaigns/{campaign['id']}/report?format=xlsx")
    assert other.status_code == 422
    assert "format" in other.json()["detail"]


def test_a_report_that_cannot_be_made_is_a_problem_with_the_reason(service, monkeypatch):
    def fail(arguments, error):
        raise error("the disk is full")

    monkeypatch.setattr("bench.service.routes.campaigns.reports.run_command", fail)
    campaign = start(service, [PROMPT])
    answer = service.client.get(f"/api/v1/campaigns/{campaign['id']}/report")
    assert answer.status_code == 409
    assert "the disk is full" in answer.json()["detail"]
    assert list(service.data.glob(".transfer-*")) == []


def list_messages(campaign, state):
    found = [one for event in campaign["events"] for one in event["notifications"]]
    return [one for one in found if one["state"] == state]


def test_a_campaign_from_the_command_line_that_cannot_be_met_ends_with_the_reason(service):
    document = parse_campaign({"name": "night", "steps": [COOL]}, "the test")
    store = service.client.app.state.context.campaign_store
    campaign = store.create(document, {}, "agent", time.time())
    ended = wait(service, {"id": campaign.id}, lambda found: found["status"] == "stopped")
    assert "no thermometer" in ended["reason"]


def test_a_campaign_on_a_bench_that_is_not_served_is_reported_and_can_be_stopped(service):
    assert service.get("/health")["campaigns"] == "ok"
    store = service.client.app.state.context.campaign_store
    document = parse_campaign({"name": "night", "steps": [RUN]}, "the test")
    store.create(document, collect_methods(document), "scenario default", time.time())
    assert service.get("/health")["campaigns"] == "ok"
    campaign = store.create(document, collect_methods(document), "left", time.time())
    words = service.get("/health")["campaigns"]
    assert words.startswith("waiting for bench left, which this service does not have: 1;")
    assert "--bench left=bench.toml" in words
    service.post(f"/campaigns/{campaign.id}/stop", {}, 200)
    assert service.get(f"/campaigns/{campaign.id}")["status"] == "stopped"
    assert service.get("/health")["campaigns"] == "ok"


def test_a_setup_step_is_done_on_the_bench_now_and_during_a_pause(service):
    service.agent.setup = {"outcome": "done", "message": "3.10 N are subtracted from the force from now on"}
    campaign = start(service, [{"rest": {"seconds": 5000}}, {"setup": {"step": "home"}}])
    path = f"/campaigns/{campaign['id']}"
    wait(service, campaign, lambda found: found["phase"] == "resting")
    service.post(f"{path}/pause", {"who": "B"})
    edit = {"edit": "do_now", "step": {"setup": {"step": "tare"}}}
    assert service.client.patch(f"/api/v1{path}", json={"who": "B", "edit": edit}).status_code == 200
    tared = wait(service, campaign, lambda found: found["items"][0]["state"] == "done")
    assert (tared["items"][0]["kind"], tared["status"]) == ("setup", "paused")
    assert tared["items"][0]["reason"] == service.agent.setup["message"]
    assert wait_for_command(service, PrepareCommand).step == "tare"
    service.agent.setup = {"outcome": "failed", "message": "the reference switch was not found"}
    service.client.patch(f"/api/v1{path}", json={"edit": {"edit": "delete", "item": "s0001"}})
    service.post(f"{path}/resume", {"who": "B"})
    asked = wait(service, campaign, lambda found: found["question"])
    assert asked["question"]["text"] == "setup step home has failed: the reference switch was not found"

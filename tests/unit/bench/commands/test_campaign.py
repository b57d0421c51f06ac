"""`mrbench campaign run --config`: needs a service, and one campaign holds the bench."""

import fcntl
import json

import pytest
from typer import BadParameter

from bench import cli
from bench.audit import AUDIT_FILE
from bench.campaigns import CampaignError, collect_methods, load_campaign
from bench.campaigns.engine import Observation, advance
from bench.campaigns.engine.edits import AddEdit
from bench.commands.campaign.bench import check_served, find_or_create
from bench.commands.campaign.catalogue import open_store
from bench.commands.campaign.control import control
from bench.commands.campaign.report import report
from bench.config import write_benches
from bench.methods import load_method
from tests.support.audit_trails import list_all
from tests.support.campaign_reports import STARTED, make_result, run_step, store_campaign
from tests.support.message_servers import serve_webhook


def write(path, **more):
    path.write_text(json.dumps({"name": "night", "steps": [{"rest": {"seconds": 5}}], **more}))
    return path


def test_a_service_is_recognised_by_its_lock(tmp_path):
    with pytest.raises(CampaignError, match="no service uses"):
        check_served(tmp_path, tmp_path / "bench.toml")
    with (tmp_path / "service.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        check_served(tmp_path, tmp_path / "bench.toml")
    with pytest.raises(CampaignError, match="mrbench serve --config"):
        check_served(tmp_path, tmp_path / "bench.toml")


def test_an_equal_campaign_is_followed_and_another_one_is_refused(tmp_path):
    with open_store(tmp_path / "data", is_created=True) as store:
        first = find_or_create(store, write(tmp_path / "a.json"), "B", "agent")
        assert find_or_create(store, tmp_path / "a.json", "B", "agent").id == first.id
        with pytest.raises(CampaignError, match=f"{first.id} holds the bench"):
            find_or_create(store, write(tmp_path / "b.json", seed=4), "B", "agent")


def test_a_campaign_is_run_on_the_bench_that_is_named(tmp_path, monkeypatch, capsys):
    data = tmp_path / "data"
    with open_store(data, is_created=True):
        write_benches(data, {"left": "/x/left.toml", "right": "/x/right.toml", "far": "tcp://rig:5570"})
    monkeypatch.setattr("bench.commands.campaign.bench._follow", lambda store, campaign, **_: campaign)
    command = ["campaign", "run", str(write(tmp_path / "a.json")), "--data", str(data), "--out", "-"]
    with (data / "service.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        with pytest.raises(SystemExit) as end:
            cli.main([*command, "--bench", "right"])
        assert not end.value.code
        assert json.loads(capsys.readouterr().out)["bench"] == "right"
        for name, words in (("up", "there is no bench 'up'"), ("far", "of bench far is at tcp://rig:5570")):
            with pytest.raises(SystemExit) as end:
                cli.main([*command, "--bench", name])
            assert end.value.code == 1
            assert words in capsys.readouterr().err
    with pytest.raises(SystemExit):
        cli.main([*command, "--bench", "right", "--scenario", "default"])
    assert "--bench NAME" in " ".join(capsys.readouterr().err.split())


def test_campaigns_of_two_benches_do_not_hold_each_other(tmp_path):
    with open_store(tmp_path / "data", is_created=True) as store:
        left = find_or_create(store, write(tmp_path / "a.json"), "B", "left")
        right = find_or_create(store, tmp_path / "a.json", "B", "right")
        assert [left.bench, right.bench] == ["left", "right"]
        assert [one.id for one in store.list_in_progress("left")] == [left.id]


def test_the_queue_is_edited_and_stopped_by_the_command_line_also_without_a_service(tmp_path, capsys):
    def act(action, **more):
        given = {"note": None, "choice": None, "edit": "", "as_json": True} | more
        control(action, "", tmp_path / "data", "B", **given)
        return capsys.readouterr().out

    with serve_webhook() as (address, received):
        with open_store(tmp_path / "data", is_created=True) as store:
            find_or_create(store, write(tmp_path / "a.json", notify=[{"webhook": address}]), "B", "agent")
        edit = '{"edit": "do_now", "step": {"rest": {"seconds": 7}}}'
        view = json.loads(act("edit", edit=edit))
        assert [item["label"] for item in view["items"]] == ["rest 7 s", "rest 5 s"]
        assert (view["events"][-1]["kind"], view["events"][-1]["who"]) == ("edit", "B")
        with pytest.raises(CampaignError, match="--edit is not an edit"):
            act("edit", edit='{"edit": "hope"}')
        assert act("test-message").strip() == "sent"
        act("stop")
    assert [one["kind"] for one in received] == ["test", "ended"]
    acts = list_all(tmp_path / "data" / "audit.jsonl")[1:]
    assert [one.action for one in acts] == ["campaign run", "campaign edit", "campaign stop"]
    assert (acts[2].old, acts[2].new) == ({"status": "running"}, {"operator": "B"})
    assert {one.target for one in acts} == {view["id"]}
    assert acts[0].actor.startswith("local:")


RUN = {"run": {"specimen": "MR-1", "method": "quick"}}


def test_methods_that_are_not_approved_are_refused_on_the_command_line(tmp_path):
    def add(method):
        steps = [{"run": {"specimen": "MR-1", "method": method}}]
        edit = json.dumps({"edit": "add", "steps": steps})
        control("edit", "", tmp_path / "data", "B", note=None, choice=None, edit=edit, as_json=True)

    path = write(tmp_path / "a.json", steps=[RUN], methods="approved")
    with open_store(tmp_path / "data", is_created=True) as store:
        with pytest.raises(CampaignError, match="not approved: quick"):
            find_or_create(store, path, "B", "agent")
        assert store.list_campaigns(1) == []
        store.catalogue.approvals.approve(load_method("quick").compute_sha256(), "The engineer")
        started = find_or_create(store, path, "B", "agent")
        add("quick")
        with pytest.raises(CampaignError, match="not approved: validation"):
            add("validation")
        assert len(store.get(started.id).state.items) == 2


def test_logs_that_do_not_fit_on_the_disk_are_refused_on_the_command_line(tmp_path, monkeypatch):
    monkeypatch.setattr("bench.commands.campaign.bench.find_usable_space", lambda folder: 1000)
    with open_store(tmp_path / "data", is_created=True) as store:
        with pytest.raises(CampaignError, match=r"the logs need up to .* GB are free"):
            find_or_create(store, write(tmp_path / "a.json", steps=[RUN]), "B", "agent")
        assert store.list_campaigns(1) == []


def test_the_simulated_plant_needs_no_approval(tmp_path):
    with open_store(tmp_path / "data", is_created=True) as store:
        document = load_campaign(write(tmp_path / "a.json", steps=[RUN], methods="approved"))
        made = store.create(document, collect_methods(document), "scenario default", 1.0)
        assert len(store.edit(made.id, AddEdit(edit="add", steps=(RUN,)), 2.0).state.items) == 2


def test_the_recipients_in_a_file_are_tried_before_the_campaign_is_started(tmp_path, capsys):
    def run(path):
        with pytest.raises(SystemExit) as end:
            cli.main(["campaign", "test-message", str(path), "--data", str(tmp_path / "none")])
        return end.value.code, capsys.readouterr()

    with serve_webhook() as (address, received):
        code, printed = run(write(tmp_path / "night.json", notify=[{"webhook": address}]))
    assert (code or 0, printed.out.strip()) == (0, "sent")
    assert [(one["kind"], one["campaign"]) for one in received] == [("test", "night")]
    assert not (tmp_path / "none").exists()
    for path, words in ((write(tmp_path / "b.json"), "no recipients"), (tmp_path / "c.json", "cannot be read")):
        code, printed = run(path)
        assert code == 1
        assert words in printed.err


def store_question(data, *, photo=True, count=1):
    """Store a campaign that asks for a photo, and return its id."""
    steps = [{"prompt": {"text": "Show the clevis", "photo": photo}}] * count
    write(data / "ask.json", steps=steps)
    with open_store(data, is_created=True) as store:
        made = find_or_create(store, data / "ask.json", "B", "agent")
        store.update(made.id, lambda state: advance(state, Observation(), state.updated, made.id))
    return made.id


def test_a_prompt_is_answered_with_a_photo_by_the_command_line(tmp_path, capsys):
    asked, picture = store_question(tmp_path), tmp_path / "clevis.jpeg"
    command = ["campaign", "resume", "--data", str(tmp_path), "--out", "-", "--photo", str(picture)]

    def run(*more):
        with pytest.raises(SystemExit) as end:
            cli.main([*command, *more])
        return end.value.code, capsys.readouterr()

    refused = {
        None: "cannot be read (No such",
        b"GIF89a": "neither JPEG nor PNG",
        b"x" * 3_000_001: "at most 3 MB",
    }
    for content, words in refused.items():
        if content is not None:
            picture.write_bytes(content)
        code, printed = run()
        assert code == 1
        assert words in printed.err
        assert "nothing was answered" in printed.err
    picture.write_bytes(b"\xff\xd8\xff\xe0 a photo")
    code, printed = run("--operator", "B")
    assert not code
    answered = json.loads(printed.out)["items"][0]
    assert (answered["state"], answered["photo"]) == ("done", f"{asked}-s0001-photo.jpg")
    assert (tmp_path / answered["photo"]).read_bytes() == picture.read_bytes()
    assert list_all(tmp_path / AUDIT_FILE)[-1].new["photo"] == str(picture)
    code, printed = run()
    assert "asks for nothing" in printed.err


def test_a_photo_is_taken_only_with_resume_and_an_answer_also_during_a_pause(tmp_path, capsys):
    asked = store_question(tmp_path, photo=False)
    with pytest.raises(SystemExit) as end:
        cli.main(["campaign", "pause", "--data", str(tmp_path), "--photo", "a.jpg"])
    assert end.value.code
    assert "use it with resume" in capsys.readouterr().err
    given = {"edit": "", "choice": None, "as_json": True}
    control("pause", "", tmp_path, "B", note=None, **given)
    control("resume", "", tmp_path, "B", note="tight", **given)
    with open_store(tmp_path) as store:
        state = store.get(asked).state
    assert (state.status, state.items[0].note) == ("paused", "tight")
    control("resume", "", tmp_path, "B", note=None, **given)
    with open_store(tmp_path) as store:
        assert store.get(asked).state.status == "running"


def test_the_newest_campaign_is_reported_without_a_service(tmp_path, capsys):
    data = tmp_path / "data"
    with open_store(data, is_created=True) as store:
        first = store_campaign(store, [run_step("MR-9")], [make_result(2600.0)])
        second = store_campaign(store, [run_step()], [make_result(2600.0)], started=STARTED + 9e4, name="morning")
    for ending in ("html", "pdf"):
        report("", data, str(tmp_path / f"report.{ending}"))
        assert f"report on {second.id}" in capsys.readouterr().err
    report(first.id, data, str(tmp_path / "first.html"))
    page = (tmp_path / "first.html").read_text()
    assert f"mrbench campaign report {first.id} --data {data} --out {tmp_path / 'first.html'}" in page
    assert "MR-9" in page
    assert "MR-9" not in (tmp_path / "report.html").read_text()
    assert (tmp_path / "report.pdf").read_bytes().startswith(b"%PDF-")


def test_a_report_without_a_campaign_or_in_another_format_is_refused_and_writes_nothing(tmp_path, capsys):
    with open_store(tmp_path / "data", is_created=True):
        pass
    out = tmp_path / "report.html"
    with pytest.raises(CampaignError, match="has no campaign"):
        report("", tmp_path / "data", str(out))
    with pytest.raises(CampaignError, match="there is no campaign night-1"):
        report("night-1", tmp_path / "data", str(out))
    with pytest.raises(BadParameter, match=r"does not end with one of \.html, \.pdf"):
        report("", tmp_path / "data", str(tmp_path / "report.xlsx"))
    with pytest.raises(SystemExit) as end:
        cli.main(["campaign", "report", "--data", str(tmp_path / "data")])
    assert end.value.code == 2
    assert "cannot be printed" in " ".join(capsys.readouterr().err.split())
    assert not out.exists()

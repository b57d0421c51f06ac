"""Methods of a campaign: by name and version from the catalogue, kept from the start to the end."""

import json
import time
from datetime import UTC, datetime

import pytest

from bench.campaigns import CampaignError, collect_methods, parse_campaign
from bench.campaigns.engine.edits import AddEdit
from bench.catalogue import MethodRow
from bench.commands.campaign.bench import find_or_create
from bench.commands.campaign.catalogue import open_store
from bench.commands.campaign.plan import plan
from bench.methods import load_method, parse_method


@pytest.fixture
def store(tmp_path):
    with open_store(tmp_path / "data", is_created=True) as opened:
        yield opened


def keep_version(store, name="quick", title="second version", **changes):
    """Store a changed copy of the method `quick`, and return it."""
    document = json.loads(load_method("quick").to_json()) | {"name": name, "title": title} | changes
    method = parse_method(document, "the test")
    row = MethodRow(
        name=name, version=0, sha256=method.compute_sha256(), document=document, created=datetime.now(UTC)
    )
    store.catalogue.methods.add(row, 2 if name == "quick" else 1)
    return method


def run(method="quick", **more):
    return {"run": {"specimen": "MR-1", "method": method, **more}}


def campaign(*steps):
    return parse_campaign({"name": "night", "steps": list(steps)}, "the test")


def test_a_name_is_the_newest_version_of_the_catalogue_and_a_version_is_that_one(store):
    second, own = keep_version(store), keep_version(store, "own")
    found = collect_methods(campaign(run(), run("own")), store.find_method)
    assert found == {"quick": second, "own": own}
    assert collect_methods(campaign(run(method_version=1)), store.find_method) == {"quick": load_method("quick")}
    assert collect_methods(campaign(run(method_version=2)), store.find_method) == {"quick": second}


def test_without_a_catalogue_the_shipped_methods_have_version_1():
    assert collect_methods(campaign(run(method_version=1))) == {"quick": load_method("quick")}
    with pytest.raises(CampaignError, match="no version 2 of method quick; leave method_version out"):
        collect_methods(campaign(run(method_version=2)))


@pytest.mark.parametrize(
    ("steps", "reason"),
    [
        ((run("unknown"),), "there is no method unknown; give a stored one"),
        ((run(method_version=9),), "there is no version 9 of method quick"),
        ((run(), run(method_version=1)), "two different methods or versions are named quick"),
    ],
)
def test_a_name_or_version_that_is_missing_or_ambiguous_is_refused(store, steps, reason):
    keep_version(store)
    with pytest.raises(CampaignError, match=reason):
        collect_methods(campaign(*steps), store.find_method)


def test_a_version_of_a_document_is_refused():
    document = json.loads(load_method("quick").to_json())
    with pytest.raises(CampaignError, match="method_version is that of a named method"):
        campaign(run(document, method_version=1))


def test_the_version_is_part_of_the_label_of_a_step(store):
    document = campaign(run(method_version=1, drive=0.2), run("validation"))
    stored = store.create(document, collect_methods(document, store.find_method), "agent", time.time())
    labels = [item.label for item in stored.state.items]
    assert labels == ["quick version 1 at 0.2 V on MR-1", "validation on MR-1"]


def test_a_campaign_keeps_its_methods_when_a_version_is_stored_later(store, tmp_path):
    path = tmp_path / "night.json"
    path.write_text(json.dumps({"name": "night", "steps": [run(), run()]}))
    started = find_or_create(store, path, "B", "agent")
    keep_version(store)
    assert find_or_create(store, path, "B", "agent").id == started.id
    edited = store.edit(started.id, AddEdit(edit="add", steps=(run(), run(method_version=1))), time.time())
    assert edited.methods == {"quick": load_method("quick")}
    assert len(edited.state.items) == 4
    with pytest.raises(CampaignError, match="has another method or version quick"):
        store.edit(started.id, AddEdit(edit="add", steps=(run(method_version=2),)), time.time())


def test_an_edit_brings_in_a_stored_method(store):
    own = keep_version(store, "own")
    document = campaign(run())
    stored = store.create(document, collect_methods(document, store.find_method), "agent", time.time())
    edited = store.edit(stored.id, AddEdit(edit="add", steps=(run("own"),)), time.time())
    assert edited.methods["own"] == own


def test_the_command_line_plans_stored_methods_and_files(store, tmp_path, capsys):
    keep_version(store, "own")
    file = tmp_path / "from_file.json"
    file.write_text(json.dumps(json.loads(load_method("quick").to_json()) | {"name": "from_file"}))
    path = tmp_path / "night.json"
    path.write_text(json.dumps({"name": "night", "steps": [run("own"), run(str(file))]}))
    plan(path, tmp_path / "data", quick=True, as_json=True)
    assert [one["method"] for one in json.loads(capsys.readouterr().out)["methods"]] == ["own", "from_file"]
    with pytest.raises(CampaignError, match="no method own"):
        plan(path, tmp_path / "empty", quick=True, as_json=True)


def test_a_file_whose_method_has_another_name_is_refused(store, tmp_path):
    file = tmp_path / "other.json"
    file.write_text(load_method("quick").to_json())
    with pytest.raises(CampaignError, match=r"has the method quick; name it quick\.json"):
        collect_methods(campaign(run(str(file))), store.find_method, allow_files=True)

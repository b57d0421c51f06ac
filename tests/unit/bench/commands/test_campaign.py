"""`mrbench campaign run --config`: needs a service, and one campaign holds the bench."""

import fcntl
import json

import pytest

from bench.campaigns import CampaignError
from bench.commands.campaign.bench import check_served, find_or_create
from bench.commands.campaign.catalogue import open_store


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
        first = find_or_create(store, write(tmp_path / "a.json"), "B")
        assert find_or_create(store, tmp_path / "a.json", "B").id == first.id
        with pytest.raises(CampaignError, match=f"{first.id} holds the bench"):
            find_or_create(store, write(tmp_path / "b.json", seed=4), "B")

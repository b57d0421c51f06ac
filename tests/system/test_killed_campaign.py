"""A campaign on the simulated plant that is edited and killed: every finished run once, nothing lost."""

import pytest

from bench.catalogue import SQLITE, keep_address, parse_address
from tests.support.campaign_author import check_audit
from tests.support.killed_campaign import KilledCampaign, check


def kill(folder, kills, seed, **options):
    campaign = KilledCampaign(folder, seed, **options)
    assert campaign.run(kills) == kills
    check(campaign)
    assert check_audit(folder, campaign.author) > 0


def test_an_edited_campaign_survives_kills_at_random_moments(tmp_path, catalogue_url):
    if parse_address(catalogue_url).drivername != SQLITE:
        keep_address(tmp_path, catalogue_url)
    kill(tmp_path, 6, seed=5)


@pytest.mark.parametrize("option", ["clock", "copy"])
def test_it_survives_steps_of_the_clock_and_a_loss_of_power(tmp_path, option):
    folder = tmp_path / "data"
    folder.mkdir()
    kill(folder, 4, seed=6, **{option: True})

"""A campaign on the simulated plant whose process is killed: every finished run once, nothing lost."""

from bench.catalogue import SQLITE, keep_address, parse_address
from tests.support import killed_campaign


def test_a_campaign_survives_kills_at_random_moments(tmp_path, catalogue_url):
    if parse_address(catalogue_url).drivername != SQLITE:
        keep_address(tmp_path, catalogue_url)
    assert killed_campaign.kill_at_random(tmp_path, 3, seed=5) == 3
    killed_campaign.check(tmp_path)

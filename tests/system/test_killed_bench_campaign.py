"""A campaign of a whole bench whose processes are killed while a person edits it: every run once, nothing lost.

The evidence has more kills of longer campaigns (``docs/evidence/campaigns.md``).
"""

import pytest

from tests.support.killed_bench_campaign import kill_campaign

KILLS, SEED = 4, 43
"""Number of kills, and a seed whose kills meet rig, agent, worker and service."""

pytestmark = [pytest.mark.wire, pytest.mark.timeout(900)]


def test_a_campaign_survives_kills_of_every_process(tmp_path):
    result = kill_campaign(tmp_path, KILLS, SEED, repeats=1)  # checks steps, runs, logs and audit trail
    assert result.kills.total() == KILLS
    assert result.runs["clean"] >= 3
    assert result.entries >= result.commands["accepted"] > 0

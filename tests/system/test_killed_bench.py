"""A process of a complete bench is killed at random moments of runs and jobs.

More kills: ``python -m tests.support.killed_bench FOLDER KILLS SEED``.
"""

import pytest

from tests.support import killed_bench


@pytest.mark.timeout(900)
def test_no_kill_loses_a_run_or_stores_a_result_twice(tmp_path):
    victims, outcomes = killed_bench.kill_at_random(tmp_path, 5, seed=11)
    assert victims.total() == outcomes.total() == 5
    assert len(victims) > 2

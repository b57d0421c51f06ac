"""Service, worker, agent and simulated rig killed at random moments: nothing that was recorded is lost.

Eight kills of one bench: twenty take seven minutes on two busy cores. The evidence has a hundred
(``docs/evidence/kills.md``). One bench is started for all tests.
"""

import pytest

from tests.support.killed_bench import kill_at_random

KILLS = 8
SEED = 21
"""Its eight kills meet each part, all of them at once, runs and the jobs that follow."""

pytestmark = [pytest.mark.wire, pytest.mark.timeout(900)]


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    return kill_at_random(tmp_path_factory.mktemp("bench"), KILLS, SEED)


def test_each_part_was_killed_and_runs_were_accepted(result):
    assert set(result.kills) == {"rig", "agent", "worker", "service", "all"}
    assert result.kills.total() == KILLS
    assert result.accepted


def test_every_start_is_answered_unless_its_service_was_killed(result):
    assert result.unanswered == []


def test_the_catalogue_has_every_run_once_with_its_log_and_one_result_of_each_job(result):
    assert result.records.problems == []


def test_no_statement_names_a_dead_process_as_alive(result):
    assert min(result.statements.values()) > 0
    assert result.untrue == []

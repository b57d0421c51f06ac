"""What becomes of jobs in the catalogue, whatever the engine does with them."""

import asyncio
from datetime import UTC, datetime

import pytest
from fake_surroundings import FakeEngine

from bench.catalogue.catalogue import Catalogue
from bench.catalogue.database import open_database, sqlite_url
from bench.catalogue.models import RunRow
from bench.jobs.engine import MOST_ATTEMPTS
from bench.jobs.keeper import JobKeeper
from bench.jobs.order import IdentifySettings


class Kept:
    """A keeper on a catalogue of its own; each call runs its own loop."""

    def __init__(self, folder):
        self.catalogue = Catalogue(open_database(sqlite_url(folder / "catalogue.db")), folder)
        self.engine, self.told = FakeEngine(), []
        self.keeper = JobKeeper(self.catalogue, self.engine, lambda job: self.told.append((job.id, job.state)))
        self.run = RunRow(
            id="run-1", method="quick", started=datetime(2026, 3, 1, tzinfo=UTC), state="ended", log="run-1.mcap",
            log_sha256="abc",
        )  # fmt: skip
        self.catalogue.add(self.run)

    def do(self, what, *given, **more):
        return asyncio.run(getattr(self.keeper, what)(*given, **more))

    def job(self, settings=None):
        return self.do("identify", self.run, settings or IdentifySettings())[0]

    def state(self, job):
        return self.catalogue.job(job.id).state


@pytest.fixture
def kept(tmp_path):
    made = Kept(tmp_path)
    yield made
    made.catalogue.close()


def test_a_job_goes_from_queued_to_done_and_each_change_is_told(kept, tmp_path):
    job = kept.job()
    kept.do("began", job.id)
    kept.do("says", job.id, "identify: refine, start 2 of 8")
    assert kept.catalogue.job(job.id).doing == "identify: refine, start 2 of 8"
    kept.do("done", job.id, {"rmse_n": 2.5})
    ended = kept.catalogue.job(job.id)
    assert (ended.state, ended.doing, ended.summary) == ("done", "", {"rmse_n": 2.5})
    assert kept.catalogue.path_of(ended.result).parent == tmp_path
    assert [state for _, state in kept.told] == ["queued", "running", "running", "done"]


def test_the_same_work_is_not_begun_twice_but_other_settings_are_other_work(kept):
    first = kept.job()
    again, new = kept.do("identify", kept.run, IdentifySettings())
    assert (again.id, new) == (first.id, False)
    other, new = kept.do("identify", kept.run, IdentifySettings(stages=("refine",)))
    assert new
    assert set(kept.engine.orders) == {first.id, other.id}


def test_what_has_failed_may_be_asked_for_again(kept):
    first = kept.job()
    kept.do("failed", first.id, "too little is left to fit")
    again, new = kept.do("identify", kept.run, IdentifySettings())
    assert new
    assert again.id != first.id
    assert kept.catalogue.job(first.id).error == "too little is left to fit"


def test_a_job_that_kills_its_worker_is_begun_so_often_and_no_more(kept):
    job = kept.job()
    for _ in range(MOST_ATTEMPTS):
        kept.do("began", job.id)
    assert kept.state(job) == "running"
    kept.do("began", job.id)
    assert kept.state(job) == "failed"
    assert f"begun {MOST_ATTEMPTS} times and never ended" in kept.catalogue.job(job.id).error
    assert kept.engine.cancelled == [(job.id, True)]


def test_one_that_waits_is_cancelled_at_once_one_that_runs_by_its_worker(kept):
    waiting = kept.job()
    assert kept.do("cancel", waiting).state == "cancelled"
    running = kept.job(IdentifySettings(stages=("refine",)))
    kept.do("began", running.id)
    assert kept.do("cancel", kept.catalogue.job(running.id)).state == "running"
    assert kept.engine.cancelled == [(waiting.id, False), (running.id, True)]
    kept.do("cancelled", running.id)
    assert kept.state(running) == "cancelled"


def test_what_has_ended_stays_as_it_ended(kept):
    job = kept.job()
    kept.do("cancelled", job.id)
    for late in (("began",), ("says", "still at it"), ("done", {"rmse_n": 1.0}), ("failed", "lost")):
        kept.do(late[0], job.id, *late[1:])
    ended = kept.catalogue.job(job.id)
    assert (ended.state, ended.doing, ended.error, ended.summary) == ("cancelled", "", "", None)
    assert kept.told == [(job.id, "queued"), (job.id, "cancelled")]


def test_a_new_scheduler_is_given_all_that_is_unfinished_under_the_same_key(kept):
    done, waiting = kept.job(), kept.job(IdentifySettings(stages=("refine",)))
    kept.do("done", done.id, {})
    kept.engine.orders.clear()
    kept.do("connected")
    assert list(kept.engine.orders) == [waiting.id]
    assert kept.engine.orders[waiting.id].key == waiting.key


def test_a_word_of_a_job_that_nobody_knows_changes_nothing(kept):
    kept.do("began", "nobody's")
    kept.do("done", "nobody's", {})
    assert kept.told == []

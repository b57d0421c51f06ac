"""States of jobs in the catalogue, for all reports of the engine."""

import asyncio
from datetime import UTC, datetime

import pytest

from bench.catalogue.catalogue import Catalogue
from bench.catalogue.database import make_sqlite_url, open_database
from bench.catalogue.models import RunRow
from bench.jobs.engine import MAX_ATTEMPTS
from bench.jobs.job_spec import IdentifySettings
from bench.jobs.manager import JobManager
from tests.support.fake_service import FakeEngine


class ManagedJobs:
    """A job manager on an empty catalogue; each call runs its own event loop."""

    def __init__(self, folder):
        self.catalogue = Catalogue(open_database(make_sqlite_url(folder / "catalogue.db")), folder)
        self.engine, self.changes = FakeEngine(), []
        self.manager = JobManager(
            self.catalogue, self.engine, lambda job: self.changes.append((job.id, job.state))
        )
        self.run = RunRow(
            id="run-1", method="quick", started=datetime(2026, 3, 1, tzinfo=UTC), state="ended", log="run-1.mcap",
            log_sha256="abc",
        )  # fmt: skip
        self.catalogue.add(self.run)

    def call(self, method, *arguments):
        return asyncio.run(getattr(self.manager, method)(*arguments))

    def job(self, settings=None):
        return self.call("identify", self.run, settings or IdentifySettings())[0]

    def state(self, job):
        return self.catalogue.get_job(job.id).state


@pytest.fixture
def jobs(tmp_path):
    jobs = ManagedJobs(tmp_path)
    yield jobs
    jobs.catalogue.close()


def test_a_job_goes_from_queued_to_done_and_each_change_is_reported(jobs, tmp_path):
    job = jobs.job()
    jobs.call("on_started", job.id)
    jobs.call("on_progress", job.id, "identify: refine, start 2 of 8")
    assert jobs.catalogue.get_job(job.id).activity == "identify: refine, start 2 of 8"
    jobs.call("on_done", job.id, {"rmse_n": 2.5})
    ended = jobs.catalogue.get_job(job.id)
    assert (ended.state, ended.activity, ended.summary) == ("done", "", {"rmse_n": 2.5})
    assert jobs.catalogue.resolve_path(ended.result).parent == tmp_path
    assert [state for _, state in jobs.changes] == ["queued", "running", "running", "done"]


def test_an_equal_job_is_not_started_twice_but_one_with_other_settings_is(jobs):
    first = jobs.job()
    again, is_new = jobs.call("identify", jobs.run, IdentifySettings())
    assert (again.id, is_new) == (first.id, False)
    other, is_new = jobs.call("identify", jobs.run, IdentifySettings(stages=("refine",)))
    assert is_new
    assert set(jobs.engine.specs) == {first.id, other.id}


def test_a_failed_job_can_be_requested_again(jobs):
    first = jobs.job()
    jobs.call("on_failed", first.id, "too little is left to fit")
    again, is_new = jobs.call("identify", jobs.run, IdentifySettings())
    assert is_new
    assert again.id != first.id
    assert jobs.catalogue.get_job(first.id).error == "too little is left to fit"


def test_a_job_that_kills_its_worker_is_started_a_limited_number_of_times(jobs):
    job = jobs.job()
    for _ in range(MAX_ATTEMPTS):
        jobs.call("on_started", job.id)
    assert jobs.state(job) == "running"
    jobs.call("on_started", job.id)
    assert jobs.state(job) == "failed"
    assert f"started {MAX_ATTEMPTS} times and never finished" in jobs.catalogue.get_job(job.id).error
    assert jobs.engine.cancelled == [(job.id, True)]


def test_a_queued_job_is_cancelled_at_once_and_a_running_one_by_its_worker(jobs):
    queued = jobs.job()
    assert jobs.call("cancel", queued).state == "cancelled"
    running = jobs.job(IdentifySettings(stages=("refine",)))
    jobs.call("on_started", running.id)
    assert jobs.call("cancel", jobs.catalogue.get_job(running.id)).state == "running"
    assert jobs.engine.cancelled == [(queued.id, False), (running.id, True)]
    jobs.call("on_cancelled", running.id)
    assert jobs.state(running) == "cancelled"


def test_a_finished_job_keeps_its_state(jobs):
    job = jobs.job()
    jobs.call("on_cancelled", job.id)
    for late in (
        ("on_started",),
        ("on_progress", "still at it"),
        ("on_done", {"rmse_n": 1.0}),
        ("on_failed", "lost"),
    ):
        jobs.call(late[0], job.id, *late[1:])
    ended = jobs.catalogue.get_job(job.id)
    assert (ended.state, ended.activity, ended.error, ended.summary) == ("cancelled", "", "", None)
    assert jobs.changes == [(job.id, "queued"), (job.id, "cancelled")]


def test_all_unfinished_jobs_are_submitted_to_a_new_scheduler_under_their_keys(jobs):
    done, queued = jobs.job(), jobs.job(IdentifySettings(stages=("refine",)))
    jobs.call("on_done", done.id, {})
    jobs.engine.specs.clear()
    jobs.call("on_connected")
    assert list(jobs.engine.specs) == [queued.id]
    assert jobs.engine.specs[queued.id].key == queued.key


def test_a_report_on_an_unknown_job_changes_nothing(jobs):
    jobs.call("on_started", "unknown")
    jobs.call("on_done", "unknown", {})
    assert jobs.changes == []

"""States of jobs in the catalogue, for all reports of the engine."""

import asyncio
from datetime import UTC, datetime

import pytest

from bench.catalogue import CatalogueUnavailableError
from bench.catalogue.catalogue import Catalogue
from bench.catalogue.database import open_database
from bench.catalogue.models import RunRow
from bench.jobs import manager
from bench.jobs.errors import JobError
from bench.jobs.job_spec import DIAGNOSIS_FILE, FIT_FILE, TWIN_FILE
from bench.jobs.manager import JobManager
from bench.jobs.progress import JobProgress
from bench.jobs.scheduler import MAX_ATTEMPTS
from bench.jobs.settings import DiagnoseSettings, IdentifySettings
from tests.support.fake_service import FakeEngine


class ManagedJobs:
    """A job manager on an empty catalogue; each call runs its own event loop."""

    def __init__(self, folder, url):
        self.catalogue = Catalogue(open_database(url), folder)
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
def jobs(tmp_path, catalogue_url):
    jobs = ManagedJobs(tmp_path, catalogue_url)
    yield jobs
    jobs.catalogue.close()


PROGRESS = JobProgress("refine", 0.4, "identify: refine, force error 3.1 N")


def test_a_job_goes_from_queued_to_done_and_each_change_is_reported(jobs, tmp_path):
    job = jobs.job()
    jobs.call("on_started", job.id)
    jobs.call("on_progress", job.id, PROGRESS)
    running = jobs.catalogue.get_job(job.id)
    assert (running.stage, running.fraction, running.activity) == ("refine", 0.4, PROGRESS.activity)
    jobs.call("on_done", job.id, {"rmse_n": 2.5})
    ended = jobs.catalogue.get_job(job.id)
    assert (ended.state, ended.activity, ended.summary) == ("done", "", {"rmse_n": 2.5})
    assert (ended.stage, ended.fraction) == ("refine", 1.0)
    assert jobs.catalogue.resolve_path(ended.result).parent == tmp_path
    assert [state for changed, state in jobs.changes if changed == job.id] == [
        "queued",
        "running",
        "running",
        "done",
    ]


def test_an_equal_job_is_not_started_twice_but_one_with_other_settings_is(jobs):
    first = jobs.job()
    again, is_new = jobs.call("identify", jobs.run, IdentifySettings())
    assert (again.id, is_new) == (first.id, False)
    other, is_new = jobs.call("identify", jobs.run, IdentifySettings(stages=("refine",)))
    assert is_new
    assert set(jobs.engine.specs) == {first.id, other.id}


def test_a_failed_job_that_is_requested_again_keeps_its_row_and_counts_its_attempts_on(jobs):
    first = jobs.job()
    jobs.call("on_started", first.id)
    jobs.call("on_failed", first.id, "too little is left to fit")
    again, is_queued = jobs.call("identify", jobs.run, IdentifySettings())
    assert (is_queued, again.id, again.state, again.error) == (True, first.id, "queued", "")
    (retry,) = again.retries
    assert (retry["after"], retry["error"]) == ("failed", "too little is left to fit")
    jobs.call("on_started", first.id)
    assert jobs.catalogue.get_job(first.id).attempts == 2
    assert jobs.engine.specs[first.id].submission == 2


def test_a_repeated_job_may_be_started_as_often_as_a_new_one(jobs):
    job = jobs.job()
    for _ in range(MAX_ATTEMPTS + 1):
        jobs.call("on_started", job.id)
    assert jobs.state(job) == "failed"
    repeated = jobs.call("retry", job, "the worker has more memory now")
    assert repeated.retries[0]["reason"] == "the worker has more memory now"
    for number in range(1, MAX_ATTEMPTS + 1):
        jobs.call("on_started", job.id)
        assert jobs.catalogue.get_job(job.id).attempts == MAX_ATTEMPTS + number
    assert jobs.state(job) == "running"


@pytest.mark.parametrize("report", [("on_started",), ("on_done", {})])
def test_a_job_that_is_running_or_done_is_not_repeated(jobs, report):
    job = jobs.job()
    jobs.call(report[0], job.id, *report[1:])
    before = jobs.state(job)
    assert jobs.call("retry", job, "again") is None
    assert jobs.state(job) == before


def test_a_job_whose_files_were_removed_is_queued_again(jobs):
    job = jobs.job()
    jobs.call("on_done", job.id, {})
    folder = jobs.catalogue.resolve_path(jobs.catalogue.get_job(job.id).result)
    folder.mkdir()
    assert jobs.call("identify", jobs.run, IdentifySettings())[1] is False
    folder.rmdir()
    again, is_queued = jobs.call("identify", jobs.run, IdentifySettings())
    assert (is_queued, again.id) == (True, job.id)


def complete(jobs, job, *files):
    """Report a job as done, with its files."""
    jobs.call("on_done", job.id, {})
    done = jobs.catalogue.get_job(job.id)
    folder = jobs.catalogue.resolve_path(done.result)
    folder.mkdir()
    for name in files:
        (folder / name).write_text("{}")
    return done


def diagnoses(jobs):
    return [row for row in jobs.catalogue.list_jobs(10) if row.kind == "diagnose"]


@pytest.mark.parametrize(("outcome", "count"), [("clean", 1), ("lossy", 1), ("truncated", 0), ("incomplete", 0)])
def test_the_first_identification_of_a_whole_run_is_followed_by_a_diagnosis(jobs, outcome, count):
    jobs.run = jobs.catalogue.update_run("run-1", outcome=outcome)
    job = jobs.job()
    jobs.call("on_done", job.id, {})
    assert len(diagnoses(jobs)) == count
    assert all(row.inputs == {"fit": job.id} and row.state == "queued" for row in diagnoses(jobs))
    assert {job.id, *(row.id for row in diagnoses(jobs))} == set(jobs.engine.specs)


def test_a_further_identification_is_not_followed_by_a_second_diagnosis(jobs):
    jobs.run = jobs.catalogue.update_run("run-1", outcome="clean")
    jobs.call("on_done", jobs.job().id, {})
    jobs.call("on_done", jobs.job(IdentifySettings(stages=("refine",))).id, {})
    assert len(diagnoses(jobs)) == 1


def test_a_diagnosis_receives_the_newest_fit_for_its_report_and_the_twin_of_a_model(jobs):
    fit = complete(jobs, jobs.job(), FIT_FILE)
    first = jobs.call("request", jobs.run, DiagnoseSettings())[0]
    spec = jobs.engine.specs[first.id]
    assert spec.fit == str(jobs.catalogue.resolve_path(fit.result) / FIT_FILE)
    diagnosis = complete(jobs, first, DIAGNOSIS_FILE, TWIN_FILE)
    second = jobs.call("request", jobs.run, DiagnoseSettings(model=first.id))[0]
    assert jobs.engine.specs[second.id].model == str(jobs.catalogue.resolve_path(diagnosis.result) / TWIN_FILE)
    assert second.key != first.key


def test_a_model_that_does_not_exist_or_is_not_done_is_refused(jobs):
    for model in ("unknown", jobs.job().id):
        with pytest.raises(JobError, match=f"no fit or diagnosis {model}"):
            jobs.call("request", jobs.run, DiagnoseSettings(model=model))


def test_a_job_that_was_cancelled_before_it_reaches_the_engine_is_not_submitted(jobs):
    job = jobs.job()
    jobs.engine.specs.clear()
    jobs.call("on_cancelled", job.id)
    jobs.call("_submit", job)
    assert jobs.engine.specs == {}


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
        ("on_progress", PROGRESS),
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


def test_a_queued_job_is_submitted_as_soon_as_the_catalogue_can_be_read(jobs, monkeypatch):
    failures = [CatalogueUnavailableError("the server is away")] * 3
    get_run = jobs.catalogue.get_run

    def fail_at_first(run_id):
        if failures:
            raise failures.pop()
        return get_run(run_id)

    monkeypatch.setattr(manager, "_SUBMIT_PAUSE", 0.0)
    monkeypatch.setattr(jobs.catalogue, "get_run", fail_at_first)
    job = jobs.job()
    assert (failures, list(jobs.engine.specs)) == ([], [job.id])

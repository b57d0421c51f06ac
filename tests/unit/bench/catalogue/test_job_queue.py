"""Queue of jobs: one row for each content key, the order of the queue, follow-ups, batches."""

from datetime import UTC, datetime

import pytest

from bench.catalogue.catalogue import Catalogue
from bench.catalogue.database import open_database
from bench.catalogue.job_queue import JobFilter
from bench.catalogue.models import BatchRow, JobRow, RunRow


@pytest.fixture
def catalogue(tmp_path, catalogue_url):
    catalogue = Catalogue(open_database(catalogue_url), tmp_path)
    for name in ("run-1", "run-2"):
        started = datetime(2026, 3, 1, 10, tzinfo=UTC)
        catalogue.add(RunRow(id=name, method="quick", started=started, state="ended", log=f"{name}.mcap"))
    yield catalogue
    catalogue.close()


@pytest.fixture
def queue(catalogue):
    return catalogue.job_queue


def job(number, **changes):
    created = datetime(2026, 3, 1, 11, number, tzinfo=UTC)
    values = {"id": f"job-{number}", "run_id": "run-1", "kind": "identify", "key": "k", "settings": {}}
    return JobRow(**{**values, "state": "queued", "created": created, **changes})


def keep(row):
    return True


def test_a_key_has_one_row_whatever_becomes_of_it(queue):
    assert queue.request(job(1), keep)[1]
    assert queue.request(job(2), keep)[0].id == "job-1"
    for state in ("failed", "cancelled"):
        queue.finish("job-1", None, state=state, error="lost")
        row, is_queued = queue.request(job(3), keep)
        assert (row.id, row.state, row.error, is_queued) == ("job-1", "queued", "", True)
    assert [entry["after"] for entry in row.retries] == ["failed", "cancelled"]
    assert row.submissions == 3
    queue.finish("job-1", None, state="done")
    assert queue.request(job(4), keep)[1] is False
    assert [row.id for row in queue.list_jobs(JobFilter(), 10)] == ["job-1"]


def test_of_several_rows_of_a_former_catalogue_the_done_one_stands_for_the_key(catalogue, queue):
    catalogue.add(job(1, state="done"))
    catalogue.add(job(2, state="cancelled"))
    row, is_queued = queue.request(job(3), keep)
    assert (row.id, is_queued) == ("job-1", False)


def test_an_ended_job_is_not_ended_again(queue):
    queue.request(job(1), keep)
    assert queue.finish("job-1", None, state="cancelled")[0].state == "cancelled"
    assert queue.finish("job-1", job(2, kind="diagnose", key="d"), state="done") == (None, None)
    assert queue.list_jobs(JobFilter(kind="diagnose"), 10) == []


def test_a_follow_up_is_queued_with_the_end_of_its_job_and_once_for_each_run(queue):
    for number, run in ((1, "run-1"), (2, "run-1"), (3, "run-2")):
        queue.request(job(number, key=f"i{number}", run_id=run), keep)
        follow_up = job(10 + number, key=f"d{number}", run_id=run, kind="diagnose")
        queue.finish(f"job-{number}", follow_up, state="done")
    assert {row.id for row in queue.list_jobs(JobFilter(kind="diagnose"), 10)} == {"job-11", "job-13"}


def test_the_queue_is_in_the_order_in_which_jobs_were_queued_and_a_repeated_job_goes_to_its_end(queue):
    for number in (1, 2, 3):
        queue.request(job(number, key=f"k{number}"), keep)
    queue.finish("job-1", None, state="failed")
    queue.retry("job-1", "the disk has space again")
    assert queue.rank() == {"job-2": 1, "job-3": 2, "job-1": 3}
    assert [row.id for row in queue.list_unfinished()] == ["job-2", "job-3", "job-1"]


def test_jobs_are_selected_by_state_kind_and_run_page_by_page(queue):
    for number in range(1, 6):
        queue.request(job(number, key=f"k{number}", run_id=f"run-{1 + number % 2}"), keep)
    queue.finish("job-2", None, state="done")
    assert [row.id for row in queue.list_jobs(JobFilter(("done",)), 10)] == ["job-2"]
    assert [row.id for row in queue.list_jobs(JobFilter(run_id="run-2"), 10)] == ["job-5", "job-3", "job-1"]
    assert queue.list_jobs(JobFilter(kind="diagnose"), 10) == []
    first = queue.list_jobs(JobFilter(), 3)
    assert [row.id for row in queue.list_jobs(JobFilter(), 3, first[-1])] == ["job-2", "job-1"]


def test_the_newest_done_job_is_found_behind_newer_ones_without_a_result(queue):
    for number, state in ((1, "done"), (2, "done"), (3, "cancelled"), (4, "failed"), (5, None)):
        queue.request(job(number, key=f"k{number}"), keep)
        finished = datetime(2026, 3, 1, 12, number, tzinfo=UTC)
        if state:
            queue.finish(f"job-{number}", None, state=state, finished=finished, result="r")
    assert queue.find_newest_done("run-1", "identify").id == "job-2"
    assert queue.find_newest_done("run-1", "diagnose") is None


def test_batches_are_kept_and_listed_newest_first(queue):
    for number in (1, 2):
        created = datetime(2026, 3, 1, 11, number, tzinfo=UTC)
        items = [{"run": "run-1", "job": "job-1"}]
        queue.add_batch(BatchRow(id=f"b{number}", kind="identify", settings={}, created=created, items=items))
    assert [batch.id for batch in queue.list_batches(10)] == ["b2", "b1"]
    assert queue.get_batch("b1").items == [{"run": "run-1", "job": "job-1"}]
    assert queue.get_batch("none") is None

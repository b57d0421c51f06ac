"""Client: control of a run, its jobs, notes and export, against the service itself."""

import csv

import pytest

from bench.client import ClientError
from tests.support.logs import write_log
from tests.support.service_logs import write_complete_log
from tests.support.waiting import wait_until

TIMEOUT = 20.0
CHECKPOINT = "10mm_1Hz_0.2V"


@pytest.fixture
def recorded(service, bench):
    """Return a recorded run with the job of its identification."""
    write_log(service.data / "one.mcap", id="one")
    run = bench.run("one")
    wait_until(lambda: "one" in {state.id for state in bench.list_runs()})
    wait_until(lambda: run.get_state().jobs)
    return run


def test_a_paused_run_says_where_it_ends_and_is_resumed_by_a_linked_run(service, bench):
    run = bench.start("quick", "damper 7")
    assert run.pause() == f"at checkpoint {CHECKPOINT}"
    path = service.data / service.agent.status.run.log
    write_complete_log(path, run.id, "incomplete", ending="stopped", method="quick", checkpoint=CHECKPOINT)
    service.agent.finish("incomplete", f"paused at checkpoint {CHECKPOINT}", "stopped")
    assert run.wait(TIMEOUT).ending == "stopped"
    with pytest.raises(ClientError, match="has ended"):
        run.pause()
    further = run.resume()
    assert further.get_state().state == "running"
    command = next(one for one in reversed(service.agent.commands) if one.command == "run")
    assert (command.continues, command.resume_after) == (run.id, CHECKPOINT)


def test_an_aborted_run_latches_a_trip_until_a_reset(bench):
    run = bench.start("quick", "damper 7")
    run.abort()
    assert bench.get_state() == "tripped"
    bench.reset()
    assert bench.get_state() == "idle"
    bench.abort()
    assert bench.get_state() == "tripped"


def test_a_cancelled_job_is_queued_again_with_its_reason(bench, recorded):
    job = bench.job(recorded.get_state().jobs[0].id)
    with pytest.raises(ClientError, match="has not ended within 0 s"):
        job.wait(0.0)
    job.cancel()
    state = job.wait(TIMEOUT)
    assert (state.run, state.kind, state.state) == ("one", "identify", "cancelled")
    assert job.retry("the worker was busy").state == "queued"
    with pytest.raises(ClientError, match="only a failed or cancelled job can be repeated"):
        job.retry("again")


def test_a_requested_analysis_is_a_job_of_the_run(recorded):
    job = recorded.identify(hold_out=["5mm*"])
    assert job.get_state().kind == "identify"
    assert recorded.identify(hold_out=["5mm*"]).id == job.id
    assert recorded.diagnose(discover=True).get_state().kind == "diagnose"
    assert {job.id} <= {one.id for one in recorded.get_state().jobs}
    with pytest.raises(ClientError, match="stages"):
        recorded.identify(stages=["guess"])


def test_a_result_that_does_not_exist_is_refused(recorded):
    with pytest.raises(ClientError) as refusal:
        recorded.diagnosis()
    assert refusal.value.status == 404
    with pytest.raises(ClientError, match="no earlier result"):
        recorded.identify().changes()


def test_notes_of_all_pages_are_listed_in_their_order(bench, recorded, monkeypatch):
    first = recorded.add_note("Seal leaks.", "M. Curie")
    assert (first["author"], first["kind"]) == ("M. Curie", "note")
    recorded.add_note("Correction: the fitting leaks.", "P. Curie")
    original = bench._session.get
    monkeypatch.setattr(bench._session, "get", lambda path, **query: original(path, limit=1, **query))
    notes = bench.run("one").list_notes()
    assert [note["text"] for note in notes] == ["Seal leaks.", "Correction: the fitting leaks."]
    with pytest.raises(ClientError, match="author"):
        recorded.add_note("text", "")


def test_samples_are_exported_in_the_format_of_the_file(recorded, tmp_path):
    with recorded.export(tmp_path / "samples.csv").open(newline="") as file:
        assert len(list(csv.reader(file))) > 1000
    assert recorded.export(tmp_path / "samples", "parquet").read_bytes().startswith(b"PAR1")
    with pytest.raises(ClientError, match="format"):
        recorded.export(tmp_path / "samples.docx")

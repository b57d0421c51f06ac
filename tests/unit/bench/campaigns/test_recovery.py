"""Reports on runs whose process has ended, by what is left of their logs."""

import pytest

from bench.campaigns.benches.recovery import NO_LOG_REASON, recover_execution
from bench.catalogue import RunRow, catalogue_log, open_catalogue
from bench.log.mcap_file import MAGIC
from tests.support.service_logs import STARTED, write_complete_log, write_truncated_log

LOG = "night-s0001-1.mcap"


@pytest.fixture
def catalogue(tmp_path):
    with open_catalogue(tmp_path, is_created=True) as opened:
        yield opened


def add_run(catalogue, state="running"):
    catalogue.add(RunRow(id="run-1", method="quick", source="run", state=state, started=STARTED, log=LOG))


def test_a_run_without_a_log_belongs_to_its_step(catalogue):
    add_run(catalogue)
    report = recover_execution(catalogue, LOG)
    assert (report.kind, report.run, report.has_samples) == ("crashed", "run-1", False)
    row = catalogue.get_run("run-1")
    assert report.reason == row.reason == NO_LOG_REASON
    assert (row.state, row.outcome) == ("ended", "incomplete")


def test_a_run_that_the_catalogue_has_ended_keeps_its_reason(catalogue):
    add_run(catalogue, "ended")
    catalogue.update_run("run-1", outcome="incomplete", reason="stopped by A")
    assert recover_execution(catalogue, LOG).run == "run-1"
    assert catalogue.get_run("run-1").reason == "stopped by A"


def test_a_run_that_never_began_has_no_id(catalogue):
    report = recover_execution(catalogue, LOG)
    assert (report.kind, report.run, report.has_samples) == ("crashed", "", False)


def test_a_run_whose_log_has_no_sample_says_where_the_log_is_kept(catalogue):
    (catalogue.folder / LOG).write_bytes(MAGIC)
    add_run(catalogue, "truncated")
    report = recover_execution(catalogue, LOG)
    row = catalogue.get_run("run-1")
    [kept] = [path for path in catalogue.folder.iterdir() if path.name.startswith(LOG)]
    assert kept.suffix == ".broken"
    assert (report.run, report.has_samples) == ("run-1", False)
    assert (row.state, row.outcome) == ("ended", "incomplete")
    assert f"cannot be repaired and is kept as {kept.name}" in row.reason
    assert "before it wrote a sample" in row.reason


def test_a_truncated_log_is_repaired_and_its_run_can_be_continued(catalogue):
    write_truncated_log(catalogue.folder / LOG)
    report = recover_execution(catalogue, LOG)
    row = catalogue.get_run("run-1")
    assert (report.kind, report.run, report.has_samples) == ("crashed", "run-1", True)
    assert (row.state, row.outcome) == ("ended", "incomplete")
    assert catalogue_log(catalogue, catalogue.folder / LOG).integrity == "intact"


def test_a_complete_log_counts_as_a_run(catalogue):
    write_complete_log(catalogue.folder / LOG)
    report = recover_execution(catalogue, LOG)
    assert (report.kind, report.run, report.outcome) == ("ended", "run-1", "clean")

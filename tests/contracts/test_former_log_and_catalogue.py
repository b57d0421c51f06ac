"""A log and a catalogue of commit 47f8566 can be read."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from bench.catalogue import Catalogue, make_sqlite_url, open_database, scan_logs
from bench.log import read_log
from identification.fitting import assemble
from identification.logs import load

FOLDER = Path(__file__).parent / "documents_47f8566"
LOG = FOLDER / "run.mcap"


@pytest.fixture
def catalogue(tmp_path):
    """Catalogue in a copy of the folder; opening it migrates the tables."""
    for name in ("catalogue.db", "run.mcap"):
        shutil.copy(FOLDER / name, tmp_path / name)
    opened = Catalogue(open_database(make_sqlite_url(tmp_path / "catalogue.db")), tmp_path)
    yield opened
    opened.close()


def test_a_former_log_keeps_its_identity_and_its_samples():
    log = read_log(LOG)
    run = log.metadata["run"]
    assert (run["specimen"], run["operator"], run["method"], log.outcome) == ("D7", "anna", "short", "clean")
    assert [segment.name for segment in log.segments] == ["5mm_2.5Hz_0.1V", "5mm_2.5Hz_0.5V"]
    assert np.ptp(log.samples["displacement"]) == pytest.approx(0.01, rel=0.02)


def test_a_former_log_can_be_identified():
    problem = assemble([load(LOG)])
    assert sum(len(piece.force) for piece in problem.pieces) > 600


def test_a_former_catalogue_keeps_runs_and_jobs(catalogue):
    states = {row.log: row.state for row in catalogue.list_runs(10)}
    assert states == {"run.mcap": "ended", "killed.mcap": "truncated"}
    endings = {row.log: row.ending for row in catalogue.list_runs(10)}
    assert endings == {"run.mcap": "completed", "killed.mcap": None}
    job = catalogue.get_job("job1")
    assert (job.kind, job.state, job.activity, job.attempts) == ("identify", "queued", "pinn", 1)


def test_a_scan_finds_the_former_run_again(catalogue):
    scan_logs(catalogue, lambda path: False)
    (run,) = (row for row in catalogue.list_runs(10) if row.log == "run.mcap")
    assert (run.specimen, run.outcome, run.state) == ("D7", "clean", "ended")

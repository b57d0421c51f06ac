"""Execution of a job by a worker, with a command line that the test provides."""

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from bench.jobs.errors import JobCancelledError, JobError
from bench.jobs.job_spec import (
    DIAGNOSIS_FILE,
    FIT_FILE,
    REPORT_FILE,
    TWIN_FILE,
    JobSpec,
    compute_content_key,
    get_result_folder,
)
from bench.jobs.settings import DiagnoseSettings, IdentifySettings, PredictSettings
from bench.jobs.work import WATCHDOG_COMMAND, JobCallbacks, execute_job
from tests.support.logs import write_log
from tests.support.reports import prediction
from tests.support.result_documents import diagnosis_document, fit_document
from tests.support.waiting import wait_until

COMMAND = """
import json, os, pathlib, sys, time
folder = pathlib.Path(sys.argv[0]).parent
arguments = sys.argv[1:]
with (folder / "calls").open("a") as calls:
    print(json.dumps([os.getpid(), *arguments]), file=calls)
print("half way", file=sys.stderr, flush=True)
{act}
out = pathlib.Path(arguments[arguments.index("--out") + 1])
texts = {{"identify": "fit.json", "diagnose": "diagnosis.json", "predict": "prediction.json"}}
name = texts.get(arguments[0])
out.write_text((folder / name).read_text() if name else "<title>page</title>")
if "--twin" in arguments:
    pathlib.Path(arguments[arguments.index("--twin") + 1]).write_text("{{}}")
"""
HANG = "time.sleep(600)"
FAIL = "sys.exit('mrbench: too little is left to fit')"


class Bench:
    """A log, a job on it, and a command line with a given action."""

    def __init__(self, folder, fit):
        self.folder = folder
        (folder / "fit.json").write_text(json.dumps(fit))
        (folder / "diagnosis.json").write_text(json.dumps(diagnosis_document()))
        log = folder / "run.mcap"
        log.write_bytes(b"log")
        settings = IdentifySettings()
        key = compute_content_key("ab" * 32, settings)
        self.spec = JobSpec("job", key, str(log), str(get_result_folder(log, "identify", key)), settings)
        self.progress = []

    def command(self, act="pass"):
        script = self.folder / "command.py"
        script.write_text(COMMAND.format(act=act))
        return (sys.executable, str(script))

    def execute(self, act="pass", cancelled=lambda: False, **changes):
        spec = replace(self.spec, **changes)
        return execute_job(spec, JobCallbacks(self.progress.append, cancelled), self.command(act))

    def calls(self):
        try:
            lines = (self.folder / "calls").read_text().splitlines()
        except FileNotFoundError:
            return []
        return [json.loads(line) for line in lines if line.endswith("]")]

    @property
    def results(self):
        return sorted(path.name for path in self.folder.iterdir() if ".fit-" in path.name)


@pytest.fixture
def bench(tmp_path):
    return Bench(tmp_path, fit_document())


def is_running(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_fit_and_report_appear_together_next_to_the_log(bench):
    summary = bench.execute()
    result = Path(bench.spec.result)
    assert result.parent == bench.folder
    assert sorted(path.name for path in result.iterdir()) == [FIT_FILE, REPORT_FILE]
    assert summary["result"] == "converged"
    assert summary["rmse_n"] == json.loads((result / FIT_FILE).read_text())["rmse_n"]["train"]
    assert [call[1] for call in bench.calls()] == ["identify", "report"]
    assert bench.calls()[0][-1] == "--stages=pinn,refine"
    assert [progress.activity for progress in bench.progress] == [
        "identify", "identify: half way", "report", "report: half way",
    ]  # fmt: skip
    assert bench.results == [result.name]


def test_a_diagnosis_writes_its_document_its_twin_and_a_report_with_the_fit(bench):
    settings = DiagnoseSettings(hold_out=("5mm*",), discover=True)
    key = compute_content_key("ab" * 32, settings)
    result = get_result_folder(Path(bench.spec.log), "diagnose", key)
    summary = bench.execute(
        settings=settings, key=key, result=str(result), fit="/data/fit.json", model="/data/twin.json"
    )
    assert sorted(path.name for path in result.iterdir()) == [DIAGNOSIS_FILE, REPORT_FILE, TWIN_FILE]
    assert summary["verdict"] == "explained"
    assert summary["effects"] == ["force_delay"]
    (_, _, *analysis), (_, _, *report) = bench.calls()
    assert analysis[-4:] == ["--hold-out=5mm*", "--discover", "--model", "/data/twin.json"]
    assert report[report.index("--fit") + 1] == "/data/fit.json"
    assert report[report.index("--diagnosis") + 1].endswith(DIAGNOSIS_FILE)


REPORTS = """
for stage, fraction in (("read", 0.0), ("refine", 0.5), ("refine", 0.25)):
    print(json.dumps({{"stage": stage, "fraction": fraction, "message": "3.1 N"}}), file=sys.stderr, flush=True)
assert os.environ["MRBENCH_PROGRESS"] == "json"
"""


def test_stage_and_fraction_are_those_that_the_command_reports_and_never_fall(bench):
    bench.execute(REPORTS.format())
    found = [(one.stage, one.fraction) for one in bench.progress]
    analysis = ("identify", 0.0), ("identify", 0.0), ("read", 0.0), ("refine", 0.475), ("refine", 0.475)
    assert found[:5] == list(analysis)
    assert found[5] == ("report", 0.95)
    assert found[-1] == ("refine", pytest.approx(0.975))
    assert bench.progress[3].activity == "identify: refine, 3.1 N"


def test_a_report_of_progress_is_not_the_reason_of_a_failure(bench):
    with pytest.raises(JobError, match=r"^identify: half way$"):
        bench.execute(REPORTS.format() + "sys.exit(1)")


def test_an_existing_result_is_not_computed_again(bench):
    first = bench.execute()
    assert bench.execute(FAIL) == first
    assert len(bench.calls()) == 2


def test_a_failure_carries_the_message_of_the_command(bench):
    with pytest.raises(JobError, match=r"^identify: too little is left to fit$"):
        bench.execute(FAIL)
    assert bench.results == []


def test_cancel_ends_the_running_process(bench):
    with pytest.raises(JobCancelledError):
        bench.execute(HANG, cancelled=lambda: bool(bench.calls()))
    ((pid, *_),) = bench.calls()
    wait_until(lambda: not is_running(pid))
    assert bench.results == []


def test_a_job_beyond_its_time_limit_is_ended(bench):
    with pytest.raises(JobError, match="time limit"):
        bench.execute(HANG, settings=IdentifySettings(time_limit_s=0.01))
    assert all(not is_running(pid) for pid, *_ in bench.calls())


def test_the_work_folder_of_a_killed_attempt_is_deleted(bench):
    leftover = bench.folder / f".{Path(bench.spec.result).name}.dead"
    leftover.mkdir()
    (leftover / FIT_FILE).write_text("{")
    bench.execute()
    assert not leftover.exists()


def test_a_log_that_the_worker_cannot_read_is_an_error(bench):
    with pytest.raises(JobError, match="same path"):
        bench.execute(log="/nowhere/run.mcap")


def test_the_key_depends_on_the_content_alone():
    settings = IdentifySettings()
    assert compute_content_key("a", settings) == compute_content_key(
        "a", IdentifySettings(stages=("pinn", "refine"))
    )
    assert compute_content_key("a", settings) != compute_content_key("b", settings)
    assert compute_content_key("a", settings) != compute_content_key("a", IdentifySettings(hold_out=("5mm*",)))


@pytest.mark.parametrize("status", [0, 3])
def test_a_watched_command_ends_with_its_own_status(status):
    command = [*WATCHDOG_COMMAND, sys.executable, "-c", f"raise SystemExit({status})"]
    with subprocess.Popen(command, stdin=subprocess.PIPE) as process:
        assert process.wait(60) == status


def test_the_watchdog_of_a_command_imports_the_standard_library_only():
    with subprocess.Popen(
        [*WATCHDOG_COMMAND, sys.executable, "-c", ""], stdin=subprocess.PIPE, env={"PYTHONPROFILEIMPORTTIME": "1"},
        stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        _, imported = process.communicate(timeout=60)
    assert "threading" in imported
    assert "distributed" not in imported


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_a_watched_command_ends_with_its_parent(tmp_path, number):
    mark = tmp_path / "pids"
    inner = f"""
import os, pathlib, subprocess
child = subprocess.Popen(["sleep", "600"])
pathlib.Path({str(mark)!r}).write_text(f"{{os.getpid()}} {{child.pid}} ;")
child.wait()
"""
    parent = f"""
import subprocess
subprocess.Popen({[*WATCHDOG_COMMAND, sys.executable, "-c", inner]!r}, stdin=subprocess.PIPE).wait()
"""
    with subprocess.Popen([sys.executable, "-c", parent]) as process:
        pids = wait_until(lambda: mark.exists() and ";" in mark.read_text() and mark.read_text().split()[:2])
        assert all(is_running(pid) for pid in pids)
        os.kill(process.pid, number)
    wait_until(lambda: not any(is_running(pid) for pid in pids))


def test_the_samples_of_the_log_are_stored_for_the_views(bench):
    write_log(bench.folder / "run.mcap")
    bench.execute(log_sha256="ab" * 32)
    assert [path.name for path in (bench.folder / ".samples").iterdir()] == [f"{'ab' * 32}.npz"]


def test_an_unreadable_log_is_left_to_the_command(bench):
    assert bench.execute(log_sha256="ab" * 32)
    assert not (bench.folder / ".samples").exists()


def test_a_prediction_simulates_its_model_and_keeps_the_series(bench):
    (bench.folder / "prediction.json").write_text(prediction().model_dump_json(by_alias=True))
    settings = PredictSettings(model="job-1", free_offset=True)
    key = compute_content_key("ab" * 32, settings, ["model:abc"])
    result = bench.folder / "run.prediction-1"
    summary = bench.execute(key=key, result=str(result), settings=settings, model="/data/twin.json")
    assert summary == {"rmse_n": 2.0, "nrmse": 0.0162, "bias_n": -0.234, "noise_floor_n": 1.9, "before_n": None}
    (call,) = bench.calls()
    assert call[1:4] == ["predict", "/data/twin.json", bench.spec.log]
    assert call[call.index("--free") + 1] == "offset"
    assert call[call.index("--series") + 1].endswith("series.npz")


def test_the_report_of_a_fit_keeps_its_series(bench):
    bench.execute()
    report = bench.calls()[-1]
    assert report[report.index("--series") + 1].endswith("series.npz")

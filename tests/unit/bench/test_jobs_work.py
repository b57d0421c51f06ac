"""What a worker does for an order, with a command line that the test writes itself."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
from report_examples import fit_document

from bench.jobs.errors import JobCancelledError, JobError
from bench.jobs.order import FIT, REPORT, IdentifySettings, Order, content_key, result_folder
from bench.jobs.work import LEASH, Following, carry_out

COMMAND = """
import json, os, pathlib, sys, time
folder = pathlib.Path(sys.argv[0]).parent
words = sys.argv[1:]
with (folder / "calls").open("a") as calls:
    print(json.dumps([os.getpid(), *words]), file=calls)
print("half way", file=sys.stderr, flush=True)
{act}
out = pathlib.Path(words[words.index("--out") + 1])
out.write_text((folder / "fit.json").read_text() if words[0] == "identify" else "<title>page</title>")
"""
HANG = "time.sleep(600)"
FAIL = "sys.exit('mrbench: too little is left to fit')"


class Bench:
    """A log, an order for it, and a command line that acts as told."""

    def __init__(self, folder, fit):
        self.folder = folder
        (folder / "fit.json").write_text(json.dumps(fit))
        log = folder / "run.mcap"
        log.write_bytes(b"log")
        settings = IdentifySettings()
        key = content_key("ab" * 32, settings)
        self.order = Order("job", key, str(log), str(result_folder(log, key)), settings)
        self.said = []

    def command(self, act="pass"):
        script = self.folder / "command.py"
        script.write_text(COMMAND.format(act=act))
        return (sys.executable, str(script))

    def carry_out(self, act="pass", cancelled=lambda: False, **changes):
        order = replace(self.order, **changes)
        return carry_out(order, Following(self.said.append, cancelled), self.command(act))

    def calls(self):
        try:
            lines = (self.folder / "calls").read_text().splitlines()
        except FileNotFoundError:
            return []
        return [json.loads(line) for line in lines if line.endswith("]")]

    @property
    def left(self):
        return sorted(path.name for path in self.folder.iterdir() if ".fit-" in path.name)


@pytest.fixture
def bench(tmp_path):
    return Bench(tmp_path, fit_document())


def runs(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def await_(condition):
    deadline = time.monotonic() + 30
    while not (found := condition()):
        assert time.monotonic() < deadline
    return found


def test_fit_and_report_appear_together_beside_the_log(bench):
    summary = bench.carry_out()
    result = Path(bench.order.result)
    assert result.parent == bench.folder
    assert sorted(path.name for path in result.iterdir()) == [FIT, REPORT]
    assert summary["result"] == "converged"
    assert summary["rmse_n"] == json.loads((result / FIT).read_text())["rmse_n"]["train"]
    assert [call[1] for call in bench.calls()] == ["identify", "report"]
    assert bench.calls()[0][-1] == "--stages=pinn,refine"
    assert bench.said == ["identify", "identify: half way", "report", "report: half way"]
    assert bench.left == [result.name]


def test_what_is_done_is_not_done_again(bench):
    first = bench.carry_out()
    assert bench.carry_out(FAIL) == first
    assert len(bench.calls()) == 2


def test_a_failure_is_told_in_the_commands_own_words(bench):
    with pytest.raises(JobError, match=r"^identify: too little is left to fit$"):
        bench.carry_out(FAIL)
    assert bench.left == []


def test_cancel_ends_the_process_that_was_begun(bench):
    with pytest.raises(JobCancelledError):
        bench.carry_out(HANG, cancelled=lambda: bool(bench.calls()))
    ((pid, *_),) = bench.calls()
    await_(lambda: not runs(pid))
    assert bench.left == []


def test_a_job_beyond_its_time_limit_is_ended(bench):
    with pytest.raises(JobError, match="time limit"):
        bench.carry_out(HANG, settings=IdentifySettings(time_limit_s=0.01))
    assert all(not runs(pid) for pid, *_ in bench.calls())


def test_what_a_killed_attempt_has_left_is_swept_away(bench):
    left = bench.folder / f".{Path(bench.order.result).name}.dead"
    left.mkdir()
    (left / FIT).write_text("{")
    bench.carry_out()
    assert not left.exists()


def test_a_worker_that_cannot_see_the_log_says_so(bench):
    with pytest.raises(JobError, match="same place"):
        bench.carry_out(log="/nowhere/run.mcap")


def test_the_key_is_of_the_content():
    settings = IdentifySettings()
    assert content_key("a", settings) == content_key("a", IdentifySettings(stages=("pinn", "refine")))
    assert content_key("a", settings) != content_key("b", settings)
    assert content_key("a", settings) != content_key("a", IdentifySettings(hold_out=("5mm*",)))


@pytest.mark.parametrize("status", [0, 3])
def test_a_command_on_the_leash_ends_with_its_own_status(status):
    command = [*LEASH, sys.executable, "-c", f"raise SystemExit({status})"]
    with subprocess.Popen(command, stdin=subprocess.PIPE) as process:
        assert process.wait(60) == status


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_a_command_ends_with_the_one_who_holds_its_leash(tmp_path, number):
    mark = tmp_path / "pids"
    inner = f"""
import os, pathlib, subprocess
child = subprocess.Popen(["sleep", "600"])
pathlib.Path({str(mark)!r}).write_text(f"{{os.getpid()}} {{child.pid}} ;")
child.wait()
"""
    holder = f"""
import subprocess
subprocess.Popen({[*LEASH, sys.executable, "-c", inner]!r}, stdin=subprocess.PIPE).wait()
"""
    with subprocess.Popen([sys.executable, "-c", holder]) as process:
        pids = await_(lambda: mark.exists() and ";" in mark.read_text() and mark.read_text().split()[:2])
        assert all(runs(pid) for pid in pids)
        os.kill(process.pid, number)
    await_(lambda: not any(runs(pid) for pid in pids))

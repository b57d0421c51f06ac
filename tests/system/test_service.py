"""Service and worker as processes; each of them is killed during a job."""

import contextlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from urllib.request import Request, urlopen

import pytest

MRBENCH = (sys.executable, "-m", "bench.cli")
DEADLINE = 200.0
"""Time limit of a job on a busy machine [s]."""
ENVIRONMENT = os.environ | {"MRBENCH_NICE": "0"}
"""Workers at normal priority: at the lowest they would wait for all other tests."""
TINY = {
    "schema": "mrbench.method/1",
    "name": "tiny",
    "title": "Four cycles",
    "description": "Shortest method that can be identified.",
    "rate_hz": 500,
    "drive_kind": "coil_v",
    "limits": {"stroke_m": 0.02, "velocity_mps": 0.3, "acceleration_mps2": 6, "force_n": 1500, "drive": 0.5},
    "segments": [
        {
            "name": "10mm_2Hz",
            "motion": {"kind": "sine", "amplitude_m": 0.01, "frequency_hz": 2},
            "cycles": 4,
            "drive": {"kind": "constant", "value": 0.2},
        }
    ],
}


class ServiceProcess:
    """A service process on a data folder."""

    def __init__(self, data, token=None, command=MRBENCH, options=(), environment=None):
        self.log = data.parent / "service.log"
        self.log.unlink(missing_ok=True)
        command = [*command, "serve", "--port", "0", "--data", str(data), *options]
        with self.log.open("w") as log:
            self.process = subprocess.Popen(
                command, stdout=subprocess.PIPE, stderr=log, text=True, env=environment or ENVIRONMENT
            )
        line = self.process.stdout.readline()
        found = re.match(r"(http://127\.0\.0\.1:\d+/) \(the token is (new|unchanged)", line)
        if not found:
            self.kill()
            pytest.fail(f"no address, got {line!r}: {self.log.read_text()}")
        self.address, self.token = found[1], token or (data / "token").read_text()

    def call(self, path, method="GET"):
        headers = {"Authorization": f"Bearer {self.token}"}
        with urlopen(Request(f"{self.address}api/v1/{path}", method=method, headers=headers), timeout=30) as reply:
            return json.load(reply)

    def wait_for_job(self, condition, kind="identify"):
        """Return the only job of a kind as soon as it fulfils a condition."""
        deadline = time.monotonic() + DEADLINE
        while True:
            with contextlib.suppress(OSError):
                jobs = self.call(f"jobs?kind={kind}")["items"]
                if jobs and condition(jobs[0]):
                    assert len(jobs) == 1
                    return jobs[0]
            assert time.monotonic() < deadline, self.log.read_text()
            time.sleep(0.02)

    def find_worker(self):
        """Return the process id of the worker that was started last; wait for the first one."""
        wait_until_false(lambda: "worker_started pid=" not in self.log.read_text(), "no worker was started")
        return int(re.findall(r"worker_started pid=(\d+)", self.log.read_text())[-1])

    def end(self):
        self.process.send_signal(signal.SIGINT)
        self.process.wait(60)
        self.process.stdout.close()
        return self.process.returncode

    def kill(self):
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()


def is_running(pid):
    """Return whether a process exists and has not ended."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def find_job_processes(data):
    """Return the ids of the processes that a job has started on the logs of a folder."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            words = (process / "cmdline").read_bytes().split(b"\0")
            if any(word.startswith(bytes(data)) for word in words) and not {b"serve", b"worker"} & set(words):
                found.append(int(process.name))
    return [pid for pid in found if is_running(pid)]


def wait_for_job_processes(data):
    """Return the ids of the processes of a job; between two of its commands there is none."""
    deadline = time.monotonic() + DEADLINE
    while not (found := find_job_processes(data)):
        assert time.monotonic() < deadline, "the job started no command"
        time.sleep(0.02)
    return found


def wait_until_false(condition, message):
    deadline = time.monotonic() + DEADLINE
    while condition():
        assert time.monotonic() < deadline, message
        time.sleep(0.02)


def is_identifying(job):
    return job["state"] == "running" and job["activity"].startswith("identify")


def has_ended(job):
    return job["state"] in ("done", "failed", "cancelled")


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tiny")
    method, made = folder / "tiny.json", folder / "tiny.mcap"
    method.write_text(json.dumps(TINY))
    command = [*MRBENCH, "run", str(method), "--scenario", "default", "--seed", "3", "--out", str(made)]
    subprocess.run(command, check=True, capture_output=True, timeout=120)
    return made


@pytest.fixture
def data(log, tmp_path):
    folder = tmp_path / "runs"
    folder.mkdir()
    shutil.copy(log, folder)
    return folder


@pytest.fixture
def served(data):
    service = ServiceProcess(data)
    yield service
    if service.process.poll() is None:
        service.end()


def check_results(service, data):
    (run,) = service.call("runs")["items"]
    assert run["outcome"] == "clean"
    assert run["rmse_n"] < 2 * run["noise_floor_n"]
    assert service.call(f"runs/{run['id']}/fit")["schema"] == "mrbench.fit/1"
    (results,) = data.glob("*.fit-*")
    assert sorted(path.name for path in results.iterdir()) == ["fit.json", "report.html", "series.npz"]
    assert not list(data.glob(".*.fit-*")), "the folder of an attempt still exists"


def check_diagnosis(service, data):
    (run,) = service.call("runs")["items"]
    diagnosis = run["diagnosis"]
    assert diagnosis["verdict"] == service.call(f"runs/{run['id']}/diagnosis")["verdict"]
    assert service.call(f"twins/{diagnosis['id']}")["schema"] == "mrbench.scenario/1"
    (results,) = data.glob("*.diagnosis-*")
    assert sorted(path.name for path in results.iterdir()) == ["diagnosis.json", "report.html", "twin.json"]
    report = (results / "report.html").read_text()
    assert "Diagnosis of the sim-to-real gap" in report
    assert "noise floor" in report


def test_a_job_succeeds_after_its_worker_was_killed_and_its_run_is_diagnosed(served, data):
    served.wait_for_job(is_identifying)
    worker, commands = served.find_worker(), wait_for_job_processes(data)
    os.kill(worker, signal.SIGKILL)
    wait_until_false(lambda: any(map(is_running, commands)), "commands of the killed worker still run")
    job = served.wait_for_job(has_ended)
    assert (job["state"], job["attempts"]) == ("done", 2), job["error"]
    assert served.find_worker() != worker
    check_results(served, data)
    diagnosis = served.wait_for_job(has_ended, "diagnose")
    assert (diagnosis["state"], diagnosis["fraction"]) == ("done", 1.0), diagnosis["error"]
    check_diagnosis(served, data)


def test_a_job_succeeds_after_the_service_was_killed(served, data):
    job = served.wait_for_job(is_identifying)
    worker, commands = served.find_worker(), wait_for_job_processes(data)
    served.kill()
    wait_until_false(
        lambda: any(map(is_running, [worker, *commands])), "processes of the killed service still run"
    )
    again = ServiceProcess(data, served.token)
    try:
        found = again.wait_for_job(has_ended)
        assert (found["id"], found["state"], found["attempts"]) == (job["id"], "done", 2), found["error"]
        check_results(again, data)
    finally:
        again.end()


def test_cancel_stops_the_process_and_leaves_no_files(served, data):
    job = served.wait_for_job(is_identifying)
    commands = wait_for_job_processes(data)
    served.call(f"jobs/{job['id']}/cancel", "POST")
    assert served.wait_for_job(has_ended)["state"] == "cancelled"
    wait_until_false(lambda: any(map(is_running, commands)), "a cancelled command still runs")
    assert not list(data.glob("*fit-*"))
    assert served.call("health")["worker"] == "ok"


def test_an_interrupt_ends_the_service_and_its_worker(served, data):
    served.wait_for_job(is_identifying)
    worker, commands = served.find_worker(), wait_for_job_processes(data)
    assert served.end() == 0
    wait_until_false(lambda: any(map(is_running, [worker, *commands])), "processes of the service still run")


def test_a_second_service_on_the_same_folder_is_refused(served, data):
    command = [*MRBENCH, "serve", "--port", "0", "--data", str(data)]
    second = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert second.returncode == 1
    assert "another service uses" in second.stderr
    wait_until_false(lambda: served.call("health")["worker"] != "ok", "the first service has no worker")

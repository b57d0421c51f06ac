"""``docker-compose.yml``: the file itself, and its processes on this machine without containers."""

import json
import re
import shutil
import signal
import socket
import subprocess
import sys
from pathlib import Path
from urllib.request import Request, urlopen

import pytest
import yaml

from tests.support.live_bench import until
from tests.support.page_in_browser import CHROMIUM, FOLDER, NODE, browser_test
from tests.system.test_service import DEADLINE, ENVIRONMENT, TINY

ROOT = Path(__file__).parents[2]
FILE = ROOT / "docker-compose.yml"
PROGRAMS = Path(sys.executable).parent
COMPOSE = shutil.which("docker-compose")
SERVERS = {"database": ["CMD", "pg_isready"], "objects": ["CMD", "mc", "ready"]}
"""Health checks of the servers that are not ours."""
ORDER = ("scheduler", "sim", "rig", "worker", "service")


def services():
    return yaml.safe_load(FILE.read_text())["services"]


def dockerfile(word):
    """Return the arguments of the last such instruction of the Dockerfile."""
    return re.findall(rf"^{word} (.*)$", (ROOT / "Dockerfile").read_text(), re.MULTILINE)[-1]


@pytest.mark.skipif(
    COMPOSE is None, reason="docker-compose is not installed; run `apt-get install docker-compose`"
)
def test_docker_compose_reads_the_file():
    profiles = [word for name in ("simulated", "postgres", "object-store") for word in ("--profile", name)]
    words = [COMPOSE, "-f", FILE, *profiles, "config", "--services"]
    read = subprocess.run(words, capture_output=True, text=True, check=False)
    assert read.returncode == 0, read.stderr
    assert set(read.stdout.split()) == {*ORDER, *SERVERS}


def test_every_container_is_started_again_and_has_a_health_check_and_the_network_of_the_scheduler():
    for name, service in services().items():
        assert service["restart"] == "unless-stopped"
        checks = SERVERS.get(name, ["CMD", "mrbench", "health"])
        assert service["healthcheck"]["test"][: len(checks)] == checks
        assert service.get("network_mode") == (None if name == "scheduler" else "service:scheduler")
    assert [name for name, service in services().items() if "profiles" in service] == ["sim", *SERVERS]
    assert {"mem_limit", "cpus"} <= services()["worker"].keys()


def test_service_and_database_share_the_password_which_is_not_in_the_file():
    service, database = services()["service"], services()["database"]
    assert service["environment"]["PGPASSWORD"] == database["environment"]["POSTGRES_PASSWORD"]
    assert service["environment"]["PGPASSWORD"] == "${POSTGRES_PASSWORD:-}"
    assert "listen_addresses=127.0.0.1" in database["command"]


def test_service_and_object_store_share_the_credentials_which_are_not_in_the_file():
    service, objects = services()["service"]["environment"], services()["objects"]
    assert service["AWS_ACCESS_KEY_ID"] == objects["environment"]["MINIO_ROOT_USER"]
    assert service["AWS_SECRET_ACCESS_KEY"] == objects["environment"]["MINIO_ROOT_PASSWORD"]
    assert service["AWS_SECRET_ACCESS_KEY"] == "${AWS_SECRET_ACCESS_KEY:-}"
    assert "--address 127.0.0.1:9000" in objects["entrypoint"][-1]


def test_the_image_contains_all_packages():
    packages = {path.parent.name for path in ROOT.glob("*/__init__.py")} - {"tests", "benchmarks"}
    copied = re.findall(r"^COPY (\w+) \1$", (ROOT / "Dockerfile").read_text(), re.MULTILINE)
    assert set(copied) == packages
    project = (ROOT / "pyproject.toml").read_text()
    extras = re.search(r"pip install .*\[(.*)\]", (ROOT / "Dockerfile").read_text())[1].split(",")
    assert all(re.search(rf"^{extra} = \[", project, re.MULTILINE) for extra in extras)
    assert json.loads(dockerfile("ENTRYPOINT")) == ["mrbench"]


def free_port():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return taken.getsockname()[1]


SHORT = TINY | {
    "name": "short",
    "title": "Eight cycles at two voltages",
    "segments": [
        TINY["segments"][0] | {"cycles": 8, "drive": {"kind": "staircase", "levels": [0.1, 0.4]}},
    ],
}
"""One voltage does not determine a damper for every noise; this test is about processes."""


class Containers:
    """Processes of the file on this machine, with its volume in a folder and its network on loopback."""

    def __init__(self, folder):
        self.folder, self.scheduler, self.page = folder, free_port(), free_port()
        self.processes, self.token = {}, ""

    def make_words(self, words):
        """Return a command line of the file for this machine."""
        places = {"/data": str(self.folder), "0.0.0.0": "127.0.0.1", "8786": str(self.scheduler)}
        for former, here in places.items():
            words = [word.replace(former, here) for word in words]
        more = {"serve": ["--port", str(self.page)], "scheduler": ["--port", str(self.scheduler)]}
        return [PROGRAMS / "mrbench", *words, *more.get(words[0], ())]

    def start(self, name):
        with (self.folder / f"{name}.log").open("a") as log:
            words = self.make_words(services()[name]["command"])
            self.processes[name] = subprocess.Popen(
                words, stdout=log, stderr=subprocess.STDOUT, cwd=self.folder, env=ENVIRONMENT
            )

    def is_healthy(self, name):
        """Execute the health check of a container."""
        words = self.make_words(services()[name]["healthcheck"]["test"][2:])
        words += ["--url", self.url] if words[2] in ("service", "worker") else []
        return subprocess.run(words, capture_output=True, timeout=DEADLINE, check=False).returncode == 0

    def start_all(self):
        """Start every container; those that wait for the scheduler wait for its health."""
        for name in ORDER:
            self.start(name)
            if name == "scheduler":
                self.wait_for_health(["scheduler"])
        self.wait_for_health(ORDER)
        self.token = (self.folder / "runs" / "token").read_text().strip()

    def wait_for_health(self, names):
        """Wait until each container was healthy since its start; start every process again that has ended."""
        waiting = set(names)

        def are_healthy():
            for name in [name for name in names if self.processes[name].poll() is not None]:
                self.start(name)
                waiting.add(name)
            # Each check is a process of its own, which delays those it waits for. So only the first is asked of
            # those that have not answered yet.
            while waiting and self.is_healthy(first := next(name for name in names if name in waiting)):
                waiting.remove(first)
            return not waiting

        until(are_healthy, DEADLINE)

    def end_all(self, number):
        for process in self.processes.values():
            process.send_signal(number)
        for process in self.processes.values():
            process.wait(DEADLINE)

    @property
    def url(self):
        return f"http://127.0.0.1:{self.page}/"

    def call(self, path, body=None):
        headers = {"Authorization": f"Bearer {self.token}", "Content-Type": "application/json"}
        with urlopen(Request(f"{self.url}api/v1/{path}", body, headers), timeout=30) as reply:
            return json.load(reply)

    def record(self):
        """Record a run and wait for its fit; cancel the diagnosis, which would delay every start that follows."""
        until(lambda: self.call("bench")["state"] == "idle", DEADLINE)
        run_id = self.call("runs", json.dumps({"method": SHORT}).encode())["id"]
        until(lambda: self.call(f"runs/{run_id}")["jobs"][:1] != [], DEADLINE)
        until(lambda: self.find_job(run_id, "identify")["state"] == "done", DEADLINE)
        until(lambda: self.find_job(run_id, "diagnose"), DEADLINE)
        self.call(f"jobs/{self.find_job(run_id, 'diagnose')['id']}/cancel", b"")
        return run_id

    def find_job(self, run_id, kind):
        """Return the job of a kind on a run, or None."""
        jobs = self.call(f"runs/{run_id}")["jobs"]
        return next((job for job in jobs if job["kind"] == kind), None)


@pytest.fixture(scope="module")
def containers(tmp_path_factory):
    """Start every process of the file on a new volume."""
    containers = Containers(tmp_path_factory.mktemp("data"))
    try:
        containers.start_all()
        yield containers
    finally:
        containers.end_all(signal.SIGTERM)


@pytest.mark.wire
@pytest.mark.timeout(600)
def test_the_processes_come_up_again_after_a_stop_and_after_a_kill_twice(containers):
    recorded = [containers.record()]
    for number in (signal.SIGTERM, signal.SIGKILL, signal.SIGTERM, signal.SIGKILL):
        containers.end_all(number)
        # A stopped simulated rig takes its file with it, a killed one cannot.
        assert (containers.folder / "bench.toml").exists() is (number == signal.SIGKILL)
        containers.start_all()
    recorded.append(containers.record())
    assert len(set(recorded)) == 2
    for run_id in recorded:
        assert containers.call(f"runs/{run_id}")["outcome"] == "clean"
        assert containers.call(f"runs/{run_id}/fit")["schema"] == "mrbench.fit/1"


@pytest.mark.wire
@browser_test
def test_the_page_of_a_real_bench_starts_and_shows_a_run(containers):
    picture = containers.folder / "page.png"
    command = [
        str(NODE),
        str(FOLDER / "watch_run.mjs"),
        containers.url,
        containers.token,
        str(CHROMIUM),
        str(picture),
    ]
    result = subprocess.run(command, capture_output=True, text=True, timeout=2 * DEADLINE, check=False)
    assert result.returncode == 0, result.stderr
    seen = json.loads(result.stdout)
    assert seen["errors"] == []
    assert (seen["moved"], seen["movedAgain"]) == (6, 6)
    assert "clean" in seen["runs"][0]
    assert "MR-0042" in seen["runs"][0]
    assert picture.stat().st_size > 10_000

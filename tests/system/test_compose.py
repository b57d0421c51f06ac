"""``docker-compose.yml``: the file itself, and its processes on this machine without containers."""

import contextlib
import json
import re
import shutil
import socket
import subprocess
import sys
from pathlib import Path
from urllib.request import Request, urlopen

import pytest
import yaml

from tests.support.live_bench import until
from tests.system.test_page import CHROMIUM, FOLDER, NODE, browser_test
from tests.system.test_service import DEADLINE, ENVIRONMENT, TINY

ROOT = Path(__file__).parents[2]
FILE = ROOT / "docker-compose.yml"
PROGRAMS = Path(sys.executable).parent
COMPOSE = shutil.which("docker-compose")
ORDER = ("sim", "rig", "scheduler", "worker", "service")


def services():
    return yaml.safe_load(FILE.read_text())["services"]


def dockerfile(word):
    """Return the arguments of the last such instruction of the Dockerfile."""
    return re.findall(rf"^{word} (.*)$", (ROOT / "Dockerfile").read_text(), re.MULTILINE)[-1]


@pytest.mark.skipif(
    COMPOSE is None, reason="docker-compose is not installed; run `apt-get install docker-compose`"
)
def test_docker_compose_reads_the_file():
    words = [COMPOSE, "-f", FILE, "config", "--services"]
    read = subprocess.run(words, capture_output=True, text=True, check=False)
    assert read.returncode == 0, read.stderr
    assert set(read.stdout.split()) == set(ORDER)


def test_every_container_waits_for_its_dependencies():
    waits = {name: set(service.get("depends_on", ())) for name, service in services().items()}
    assert waits == {
        "sim": set(), "rig": {"sim"}, "scheduler": {"sim"}, "worker": {"scheduler"},
        "service": {"rig", "scheduler", "worker"},
    }  # fmt: skip
    networks = {name: service.get("network_mode") for name, service in services().items()}
    assert networks == {name: "service:sim" if name != "sim" else None for name in networks}


def test_the_image_contains_all_packages():
    packages = {path.parent.name for path in ROOT.glob("*/__init__.py")} - {"tests", "benchmarks"}
    copied = re.findall(r"^COPY (\w+) \1$", (ROOT / "Dockerfile").read_text(), re.MULTILINE)
    assert set(copied) == packages
    project = (ROOT / "pyproject.toml").read_text()
    extras = re.search(r"\[(.*)\]", dockerfile("RUN"))[1].split(",")
    assert all(re.search(rf"^{extra} = \[", project, re.MULTILINE) for extra in extras)
    assert json.loads(dockerfile("ENTRYPOINT")) == ["mrbench"]


def free_port():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return taken.getsockname()[1]


def words(service, data, scheduler):
    """Return the command line of a container, with its volume in a folder and its network on loopback."""
    line = [*service.get("entrypoint", ["mrbench"]), *service["command"]]
    here = [word.replace("/data", str(data)).replace("0.0.0.0", "127.0.0.1").replace("8786", str(scheduler))
            for word in line]  # fmt: skip
    if here[1] == "serve":
        here += ["--port", "0"]
    return [PROGRAMS / here[0], *here[1:]]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("data")


@pytest.fixture(scope="module")
def address(folder):
    """Return the address and token of the service as soon as every process of the file runs."""
    scheduler = free_port()
    with contextlib.ExitStack() as stack:
        for name in ORDER:
            log = stack.enter_context((folder / f"{name}.log").open("w"))
            line = words(services()[name], folder, scheduler)
            process = subprocess.Popen(line, stdout=log, stderr=subprocess.STDOUT, cwd=folder, env=ENVIRONMENT)
            stack.callback(process.wait, DEADLINE)
            stack.callback(process.terminate)
            if name == "sim":
                until(lambda: (folder / "bench.toml").is_file(), DEADLINE)
        text = folder / "service.log"
        until(lambda: "#token=" in text.read_text(), DEADLINE)
        yield re.search(r"(http://127\.0\.0\.1:\d+/)#token=(\S+)", text.read_text()).groups()


@pytest.mark.wire
def test_processes_of_the_file_record_and_identify(address, folder):
    def call(path, body=None):
        headers = {"Authorization": f"Bearer {address[1]}", "Content-Type": "application/json"}
        with urlopen(Request(f"{address[0]}api/v1/{path}", body, headers), timeout=30) as reply:
            return json.load(reply)

    until(lambda: call("agent")["state"] == "idle", DEADLINE)
    run_id = call("runs", json.dumps({"method": TINY}).encode())["id"]
    until(lambda: [job["state"] for job in call(f"runs/{run_id}")["jobs"]] == ["done"], DEADLINE)
    assert call(f"runs/{run_id}")["outcome"] == "clean"
    assert call(f"runs/{run_id}/fit")["schema"] == "mrbench.fit/1"


@pytest.mark.wire
@browser_test
def test_the_page_of_a_real_bench_starts_and_shows_a_run(address, folder):
    picture = folder / "page.png"
    command = [str(NODE), str(FOLDER / "watch_run.mjs"), *address, str(CHROMIUM), str(picture)]
    result = subprocess.run(command, capture_output=True, text=True, timeout=2 * DEADLINE, check=False)
    assert result.returncode == 0, result.stderr
    seen = json.loads(result.stdout)
    assert seen["errors"] == []
    assert (seen["moved"], seen["movedAgain"]) == (5, 5)
    assert "clean" in seen["runs"][0]
    assert "MR-0042" in seen["runs"][0]
    assert picture.stat().st_size > 10_000

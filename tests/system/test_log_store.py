"""Service as a process with its logs on an S3-compatible server, which goes away while runs are recorded."""

import hashlib
import json
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import numpy as np
import pytest

from bench.log.header import RunHeader
from bench.log.writer import LogWriter
from tests.support.object_server import BUCKET, SECRETS, ObjectServer
from tests.support.quick_jobs import COMMAND
from tests.system.test_service import ServiceProcess, wait_until_false

STORE = f"s3://{BUCKET}/bench-1"


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    server = ObjectServer(tmp_path_factory.mktemp("objects"))
    yield server
    server.stop()


def start(data, server, *options):
    service = ServiceProcess(data, command=COMMAND, options=options, environment=server.environment)
    service.data = data
    return service


@pytest.fixture(scope="module")
def service(tmp_path_factory, server):
    data = tmp_path_factory.mktemp("bench") / "runs"
    data.mkdir()
    service = start(data, server, "--log-store", STORE)
    yield service
    if service.process.poll() is None:
        service.end()


def record(service, name, source, during=lambda: None):
    """Record a run to the data folder, act in its middle, and return its log as soon as it is catalogued.

    A run of the source `import` is not identified, which saves time.
    """
    log = service.data / f"{name}.mcap"
    time = np.arange(1000) / 500.0
    columns = {"displacement": 0.01 * np.sin(time), "velocity": 0.01 * np.cos(time), "force": 50 * np.cos(time)}
    header = RunHeader(id=name, source=source, specimen="1", method="quick", drive_kind="coil_v", drive_unit="V")
    with LogWriter(log, header) as writer:
        for half in (slice(0, 500), slice(500, 1000)):
            samples = {key: column[half] for key, column in columns.items()}
            samples["coil_drive"] = np.full(500, 0.2)
            writer.write_samples(np.round(time[half] * 1e9).astype(np.int64), samples)
            if half.start == 0:
                during()
        writer.close("clean", "", "completed")
    wait_until_false(lambda: find(service, log) is None, "the run was not catalogued")
    return log


def find(service, log):
    """Return the id of the run with a log, or None."""
    return next((run["id"] for run in service.call("runs")["items"] if run["log"] == log.name), None)


def wait_for_copy(service, server, log):
    """Wait for the copy of a log, and compare it with the log."""
    path = f"runs/{find(service, log)}/integrity"
    wait_until_false(lambda: service.call(path)["copied"] is None, f"{log.name} was not copied")
    view = service.call(path)
    content = server.read(view["copy_url"].removeprefix(f"s3://{BUCKET}/"))
    assert hashlib.sha256(content).hexdigest() == view["recorded_sha256"]
    assert content == log.read_bytes()


def wait_for_health(service, words):
    wait_until_false(lambda: words not in service.call("health")["log_store"], f"health never said {words}")


def test_a_recorded_run_arrives_in_the_store(service, server):
    log = record(service, "run-1", "run")
    wait_for_copy(service, server, log)
    (name,) = server.list_objects()
    assert name.startswith("bench-1/run-1.")
    wait_for_health(service, "ok")


@pytest.mark.parametrize("outage", ["stopped", "silent"])
def test_a_run_that_is_recorded_while_the_store_is_away_arrives_when_it_is_back(service, server, outage):
    log = record(service, f"run-{outage}", "import", server.stop if outage == "stopped" else server.pause)
    wait_for_health(service, "1 log waits for a copy")
    assert service.call(f"runs/{find(service, log)}/integrity")["copied"] is None
    if outage == "stopped":
        wait_for_health(service, "the log store cannot be reached")
        server.start()
    else:
        server.resume()
    wait_for_copy(service, server, log)
    wait_for_health(service, "ok")


def test_neither_secrets_nor_the_endpoint_are_shown(service, server):
    text = service.log.read_text()
    assert "log_store_failed" in text
    assert "log_store_works_again" in text
    assert not [word for word in (*SECRETS.values(), f":{server.port}") if word in text]


@pytest.fixture
def removing(service, server):
    """Service that removes logs as soon as they are copied; it knows the address of the store from its folder."""
    service.end()
    removing = start(service.data, server, "--keep-local", "0")
    yield removing
    removing.end()


def request(service, path, body=None):
    """Return the answer to a GET, or to a POST with a body."""
    headers = {"Authorization": f"Bearer {service.token}", "Content-Type": "application/json"}
    content = None if body is None else json.dumps(body).encode()
    with urlopen(Request(f"{service.address}api/v1/{path}", content, headers), timeout=60) as reply:
        return reply.read()


def test_removed_logs_are_fetched_for_a_download_and_for_a_job_and_a_corrupted_one_is_refused(removing, server):
    log = removing.data / "run-1.mcap"
    # Its job may go on, and the restart of the server has lost its copy, which is then made again.
    wait_until_false(log.exists, "the log was not removed")
    view = removing.call("runs/run-1/integrity")
    assert view["removed"] is not None
    content = request(removing, "runs/run-1/log")
    assert hashlib.sha256(content).hexdigest() == view["recorded_sha256"]

    wait_until_false(log.exists, "the fetched log was not removed")
    job = json.loads(request(removing, "runs/run-1/identify", {"stages": ["refine"]}))
    wait_until_false(
        lambda: removing.call(f"jobs/{job['id']}")["state"] in ("queued", "running"), "it did not end"
    )
    assert removing.call(f"jobs/{job['id']}")["state"] == "done", removing.call(f"jobs/{job['id']}")["error"]

    wait_until_false(log.exists, "the log was not removed after the job")
    name = view["copy_url"].removeprefix(f"s3://{BUCKET}/")
    server.write(name, content[:-1] + bytes([content[-1] ^ 1]))
    with pytest.raises(HTTPError) as refused:
        request(removing, "runs/run-1/log")
    problem = json.load(refused.value)
    refused.value.close()
    assert (problem["status"], problem["type"]) == (409, "urn:mrbench:problem:log-unusable")
    assert f"{view['copy_url']} has another content than the recorded log" in problem["detail"]
    assert not log.exists()

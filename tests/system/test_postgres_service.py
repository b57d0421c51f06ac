"""Service as a process with its catalogue in PostgreSQL, which goes away during a job."""

import stat
import subprocess

import pytest

from bench.catalogue import CATALOGUE_FILE
from tests.system import test_service
from tests.system.test_service import DEADLINE, ENVIRONMENT, MRBENCH, ServiceProcess, has_ended, is_identifying

SECRET = "secret-word"
log, data = test_service.log, test_service.data


@pytest.fixture
def url(postgres_server):
    url = postgres_server.make_catalogue()
    assert SECRET in url
    yield url
    postgres_server.allow_connections(url, True)


def test_a_job_goes_on_while_the_database_is_away_and_its_result_is_recorded(data, url, postgres_server):
    service = ServiceProcess(data, options=("--catalogue", url))
    try:
        service.wait_for_job(is_identifying)
        postgres_server.allow_connections(url, False)
        test_service.wait_until_false(lambda: "_not_recorded" not in service.log.read_text(), "nothing was tried")
        postgres_server.allow_connections(url, True)
        job = service.wait_for_job(has_ended)
        assert (job["state"], job["attempts"]) == ("done", 1), job["error"]
        test_service.check_results(service, data)
    finally:
        service.end()
    assert SECRET not in service.log.read_text()
    assert not (data / CATALOGUE_FILE).exists()
    assert stat.S_IMODE((data / "catalogue.url").stat().st_mode) == 0o600
    words = [*MRBENCH, "verify", str(data)]
    done = subprocess.run(words, capture_output=True, text=True, env=ENVIRONMENT, timeout=DEADLINE, check=False)
    assert (done.returncode, done.stdout) == (0, "1 of 1 logs are unchanged since they were recorded\n")

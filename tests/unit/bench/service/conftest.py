"""Service with a rig agent and an engine under the control of the test."""

import time
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path

import pytest
from argon2 import PasswordHasher
from fastapi.testclient import TestClient

from bench.catalogue import keep_address
from bench.people import passwords
from bench.service.access import open_access
from bench.service.application import AppSettings, create_app
from bench.service.benches import BenchSettings
from tests.support.empty_catalogues import write_empty_catalogue
from tests.support.fake_service import FakeAgent, FakeEngine
from tests.support.waiting import wait_until

TIMEOUT = 20.0
"""Time limit for events in other threads [s]."""


ON_BOTH_DATABASES = {
    "test_campaigns",
    "test_jobs",
    "test_run_search",
    "test_runs",
}
"""Modules whose tests of a service run on SQLite and on PostgreSQL."""


def pytest_generate_tests(metafunc):
    name = metafunc.module.__name__.rpartition(".")[2]
    if "database" in metafunc.fixturenames and name in ON_BOTH_DATABASES:
        metafunc.parametrize("database", ["sqlite", "postgresql"], indirect=True)


class Service:
    """Service that can be started and ended repeatedly on one data folder."""

    def __init__(self, data):
        self.data = data
        self.agent = FakeAgent()
        self.engine = FakeEngine()
        self.access, self.token = open_access(data)
        self.client = None

    def start(self, **changes):
        self.end()
        self.engine = FakeEngine()
        only = {name: changes.pop(name) for name in ("link", "has_local_logs") if name in changes}
        benches = (BenchSettings(**{"link": self.agent, **only}),)
        given = {"data": self.data, "access": self.access, "benches": benches, "engine": self._engine}
        app = create_app(AppSettings(**{**given, **changes}))
        self.client = TestClient(app, base_url="http://127.0.0.1:8600", raise_server_exceptions=False)
        self.client.headers["Authorization"] = f"Bearer {self.token}"
        return self.client.__enter__()

    def end(self):
        if self.client is not None:
            self.client.__exit__(None, None, None)
            self.client = None

    def get(self, path):
        answer = self.client.get(f"/api/v1{path}")
        assert answer.status_code == 200, answer.text
        return answer.json()

    def post(self, path, body=None, status=200):
        answer = self.client.post(f"/api/v1{path}", json=body)
        assert answer.status_code == status, answer.text
        return answer.json()

    def scan(self):
        """Catalogue the logs in the data folder now."""
        self.client.portal.call(self.client.app.state.context.registry.scan)

    def wait_for(self, path, wanted):
        """Return the answer at a path as soon as it is as wanted."""
        deadline = time.monotonic() + TIMEOUT
        while not wanted(found := self.get(path)):
            assert time.monotonic() < deadline, found
        return found

    def complete(self, job, summary, files):
        """Report a job as done, with its files by name."""
        wait_until(lambda: job["id"] in self.engine.specs)  # the catalogue shows a job before
        self.report("on_started", job["id"])
        result = Path(self.engine.specs[job["id"]].result)
        result.mkdir()
        for name, text in files.items():
            (result / name).write_text(text)
        self.report("on_done", job["id"], summary)

    def report(self, event, *given):
        """Have the engine report an event of a job, on the service's event loop."""
        self.client.portal.call(getattr(self.engine.listener, event), *given)

    @asynccontextmanager
    async def _engine(self):
        yield self.engine


@pytest.fixture(autouse=True)
def quick_hashes(monkeypatch):
    """Hash passwords with the same function at its least cost: at its real one, each takes a third of a second."""
    cheap = partial(PasswordHasher, time_cost=1, memory_cost=8, parallelism=1)
    monkeypatch.setattr(passwords, "PasswordHasher", cheap)


@pytest.fixture
def database(request):
    """Return the URL of an empty catalogue in PostgreSQL; None for the SQLite file of the data folder."""
    is_server = getattr(request, "param", "sqlite") == "postgresql"
    return request.getfixturevalue("postgres_server").make_catalogue() if is_server else None


@pytest.fixture
def service(tmp_path, database):
    if database is None:
        write_empty_catalogue(tmp_path)
    else:
        keep_address(tmp_path, database)
    made = Service(tmp_path)
    made.start()
    yield made
    made.end()


@pytest.fixture
def client(service):
    return service.client

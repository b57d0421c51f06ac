"""A service on a loopback port, with a rig agent and an engine under the control of the test."""

import threading
import time
from contextlib import asynccontextmanager

import pytest
import uvicorn

from bench.client import Bench
from bench.service import run_registry
from bench.service.access import open_access
from bench.service.application import AppSettings, create_app
from bench.service.benches import BenchSettings
from tests.support.empty_catalogues import write_empty_catalogue
from tests.support.fake_service import FakeAgent, FakeEngine

TIMEOUT = 20.0


class RunningService:
    """Service in a thread of the test."""

    def __init__(self, data):
        self.data, self.agent, self.fake_engine = data, FakeAgent(), FakeEngine()
        access, self.token = open_access(data)
        app = create_app(
            AppSettings(data=data, access=access, benches=(BenchSettings(self.agent),), engine=self._engine)
        )
        self._server = uvicorn.Server(uvicorn.Config(app, port=0, log_config=None))
        self._thread = threading.Thread(target=self._server.run)

    def __enter__(self):
        self._thread.start()
        deadline = time.monotonic() + TIMEOUT
        while not self._server.started:
            assert time.monotonic() < deadline
            time.sleep(0.01)
        self.url = f"http://127.0.0.1:{self._server.servers[0].sockets[0].getsockname()[1]}"
        return self

    def __exit__(self, *error):
        self._server.should_exit = True
        self._thread.join()

    @asynccontextmanager
    async def _engine(self):
        yield self.fake_engine


@pytest.fixture
def service(tmp_path, monkeypatch):
    # Tests put logs into the data folder and wait until they are listed.
    monkeypatch.setattr(run_registry, "SCAN_PERIOD", 0.1)
    write_empty_catalogue(tmp_path)
    with RunningService(tmp_path) as running:
        yield running


@pytest.fixture
def bench(service):
    return Bench(service.url, service.token)

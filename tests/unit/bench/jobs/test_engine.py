"""Engine of jobs while the catalogue cannot be reached, and the state of its workers."""

import asyncio
from types import SimpleNamespace

import pytest

from bench.catalogue import CatalogueUnavailableError
from bench.jobs.engine import DaskEngine
from bench.jobs.scheduler import WORKER_STATES
from bench.jobs.tls import SchedulerLocation

PROGRESS = {"stage": "refine", "fraction": 0.4, "activity": "identify: refine"}


class Listener:
    """Listener whose catalogue is away for the first calls."""

    def __init__(self, failures):
        self.failures, self.heard = failures, []

    async def on_connected(self):
        self._hear("connected")

    async def on_progress(self, job_id, progress):
        self._hear(job_id)

    def _hear(self, what):
        if self.failures:
            self.failures -= 1
            raise CatalogueUnavailableError("the server is away")
        self.heard.append(what)


def make_engine(failures):
    engine = DaskEngine(SchedulerLocation("tls://127.0.0.1:1", None))
    engine._client, engine._listener = SimpleNamespace(status="running"), Listener(failures)
    return engine


def test_unfinished_jobs_are_submitted_once_when_the_catalogue_is_back(caplog):
    engine = make_engine(2)
    for _ in range(5):
        asyncio.run(engine._announce())
    assert engine._listener.heard == ["connected"]
    assert [record.message for record in caplog.records] == ["jobs_not_submitted"] * 2


def test_progress_that_cannot_be_recorded_is_left_out(caplog):
    engine = make_engine(1)
    engine._submissions = {"job": None}
    for _ in range(2):
        asyncio.run(engine._on_event((0.0, {"job": "job", "progress": PROGRESS})))
    assert engine._listener.heard == ["job"]
    assert [record.message for record in caplog.records] == ["job_progress_not_recorded"]


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ({"tls://127.0.0.1:2": {"age": 0.4, "suspended_pid": 0}}, "ok"),
        ({"tls://127.0.0.1:2": {"age": 40.0, "suspended_pid": 0}}, "no answer from the worker for 40 s"),
        (TimeoutError(), "the scheduler at tls://127.0.0.1:1 does not reply"),
    ],
)
def test_the_state_follows_the_workers(answer, words):
    async def ask():
        if isinstance(answer, Exception):
            raise answer
        return answer

    engine = make_engine(0)
    engine._client.scheduler = SimpleNamespace(**{WORKER_STATES: ask})
    assert asyncio.run(engine.describe_state()).startswith(words)


def test_the_scheduler_is_asked_twice_a_second_at_most():
    asked = []

    async def ask():
        asked.append(True)
        return {"tls://127.0.0.1:2": {"age": 0.0, "suspended_pid": 0}}

    async def ask_often():
        return await asyncio.gather(*(engine.describe_state() for _ in range(5)))

    engine = make_engine(0)
    engine._client.scheduler = SimpleNamespace(**{WORKER_STATES: ask})
    assert asyncio.run(ask_often()) == ["ok"] * 5
    assert len(asked) == 1

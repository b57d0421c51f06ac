"""The page of a service with two benches, in a real browser: list, addresses, start, stop, search."""

import json
import subprocess
import threading
import time
from contextlib import asynccontextmanager, contextmanager

import pytest
import uvicorn

from bench.agent_protocol import RunCommand
from bench.service.access import open_access
from bench.service.application import AppSettings, create_app
from bench.service.benches import BenchSettings
from tests.support.fake_service import FakeAgent, FakeEngine
from tests.support.page_in_browser import CHROMIUM, FOLDER, NODE, browser_test

PERIOD = 0.2
"""[s] Time between two statuses of an agent."""


@asynccontextmanager
async def open_engine():
    yield FakeEngine()


@contextmanager
def served(agents, data):
    """Serve benches on a loopback port while the block lasts; their agents publish their statuses."""
    access, token = open_access(data)
    benches = tuple(BenchSettings(agent, name=name) for name, agent in agents.items())
    app = create_app(AppSettings(data=data, access=access, benches=benches, engine=open_engine))
    server = uvicorn.Server(uvicorn.Config(app, port=0, log_config=None))
    ending = threading.Event()
    threads = [threading.Thread(target=server.run), threading.Thread(target=publish, args=(agents, ending))]
    for thread in threads:
        thread.start()
    try:
        deadline = time.monotonic() + 30
        while not server.started:
            assert time.monotonic() < deadline
            time.sleep(0.01)
        yield f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}", token
    finally:
        ending.set()
        server.should_exit = True
        for thread in threads:
            thread.join()


def publish(agents, ending):
    while not ending.wait(PERIOD):
        for agent in agents.values():
            agent.publish()


@pytest.fixture(scope="module")
def agents():
    """Return the agents of two benches; the one named `right` has tripped."""
    made = {name: FakeAgent(name) for name in ("left", "right")}
    for agent in made.values():
        agent.status = agent.status.model_copy(update={"drive_kind": "coil_v", "drive_unit": "V"})
    made["right"].status = made["right"].status.model_copy(update={"state": "tripped", "trip": "door open"})
    return made


@pytest.fixture(scope="module")
def seen(agents, tmp_path_factory):
    """Return what a person sees who works on both benches."""
    with served(agents, tmp_path_factory.mktemp("data")) as (address, token):
        command = [str(NODE), str(FOLDER / "use_benches.mjs"), address, token, str(CHROMIUM)]
        result = subprocess.run(command, capture_output=True, text=True, timeout=280, check=False)
    assert result.returncode == 0, result.stderr
    return json.loads(result.stdout)


@browser_test
def test_the_list_shows_the_state_of_every_bench(seen):
    assert seen["errors"] == []
    assert seen["listed"] == ["left idle", "right tripped: door open"]


@browser_test
def test_the_first_bench_is_shown_and_stands_in_the_address_of_each_view(seen):
    assert seen["first"] == {
        "current": "left",
        "address": "#/@left/bench",
        "state": "left Idle",
        "stop": "Stop left",
    }
    assert seen["runs"] == "#/@left/runs"


@browser_test
def test_another_bench_is_chosen_by_keyboard_and_keeps_the_view(seen):
    assert seen["second"] == {"current": "right", "address": "#/@right/runs", "state": "right Tripped",
                              "stop": "Stop right"}  # fmt: skip
    assert seen["bookmark"] == "right"


@browser_test
def test_a_run_starts_on_the_shown_bench_and_is_found_by_it(seen, agents):
    assert [type(one) for one in agents["left"].commands].count(RunCommand) == 1
    assert [type(one) for one in agents["right"].commands].count(RunCommand) == 0
    assert seen["found"] == [True, False]
    assert seen["stopped"] == "Stopping"
    assert (agents["left"].status.state, agents["right"].status.state) == ("stopping", "tripped")


@browser_test
def test_the_list_is_accessible(seen):
    assert seen["audit"] == []
    assert seen["small"] == []

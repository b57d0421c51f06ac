"""Sign-in by a provider in a real browser: cookies and redirects between two sites."""

import json
import re
import subprocess
import time
from contextlib import asynccontextmanager, contextmanager
from threading import Thread

import pytest
import uvicorn

from bench.oidc import Fault, OidcConfig
from bench.service.access import open_access
from bench.service.application import AppSettings, create_app
from bench.service.benches import BenchSettings
from tests.support.fake_page_service import STATIC
from tests.support.fake_service import FakeAgent, FakeEngine
from tests.support.page_in_browser import CHROMIUM, FOLDER, NODE, browser_test
from tests.support.stub_provider import CLIENT, SECRET, StubProvider, served_provider


@pytest.fixture
def provider():
    with served_provider() as made:
        made.address = made.address.replace("127.0.0.1", "localhost")  # another site than that of the service
        refuse_once(made)
        yield made


def refuse_once(provider: StubProvider) -> None:
    """Have the provider refuse the first sign-in."""
    authorise, provider.refusal = provider.authorise, "access_denied"

    def authorise_later(query):
        address, provider.refusal = authorise(query), ""
        return address

    provider.authorise = authorise_later


@contextmanager
def served_bench(data, provider):
    """Serve a bench with the provider for the duration of a block, and return the address of its page."""
    given = {"issuer": provider.address, "client_id": CLIENT, "client_secret": SECRET, "name": "Lab account"}
    config = OidcConfig.model_validate({**given, "roles": {"lab-engineers": "engineer"}})

    @asynccontextmanager
    async def open_engine():
        yield FakeEngine()

    access, _ = open_access(data)
    app = create_app(
        AppSettings(
            data=data, access=access, benches=(BenchSettings(FakeAgent()),), engine=open_engine, oidc=config
        )
    )
    server = uvicorn.Server(uvicorn.Config(app, port=0, log_config=None))
    thread = Thread(target=server.run)
    thread.start()
    try:
        while not server.started:
            assert thread.is_alive()
            time.sleep(0.02)
        yield f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}/"
    finally:
        server.should_exit = True
        thread.join()


@browser_test
def test_a_browser_signs_in_on_another_site_and_returns_to_its_view(tmp_path, provider):
    with served_bench(tmp_path, provider) as address:
        command = [str(NODE), str(FOLDER / "sign_in_by_provider.mjs"), address, str(CHROMIUM), str(tmp_path)]
        result = subprocess.run(command, capture_output=True, text=True, timeout=180, check=False)
    assert result.returncode == 0, result.stderr
    seen = json.loads(result.stdout)
    assert seen["height"] >= 44  # px, a target for a finger
    assert seen["refused"]["problem"].startswith("The sign-in provider refused")
    assert seen["refused"]["hash"] == "#/runs?specimen=S%201"
    assert seen["view"] == "#/runs?specimen=S%201"
    assert (seen["person"]["name"], seen["person"]["role"]) == ("mcurie", "engineer")
    assert seen["cookies"] == ""
    assert seen["unknown"] == {
        "problem": "The sign-in failed. Try again, or sign in with a password.",
        "hash": "#/plan",
    }
    assert provider.faults == []


def test_the_page_has_a_sentence_for_each_fault():
    text = (STATIC / "common" / "sign_in_ways.js").read_text("utf-8")
    table = text[text.index("const PROBLEMS = {") :].partition("};")[0]
    assert set(re.findall(r'^  "?([a-z-]+)"?:', table, re.MULTILINE)) == {fault.value for fault in Fault}

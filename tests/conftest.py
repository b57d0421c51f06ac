"""Options for all tests."""

import functools
import os
from pathlib import Path

import pytest

LEFT_OUT = pytest.StashKey[list[str]]()

# Two test processes share two cores. A matrix library that starts a thread for each core makes both of them wait.
for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--fail-on-skip",
        action="store_true",
        help="fail if a test was skipped",
    )


@pytest.hookimpl(tryfirst=True)  # before the conditions of `-m` apply
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keep the marked tests that ``make`` would leave out, because it finds their files by a word."""
    config.stash[LEFT_OUT] = [
        item.nodeid
        for word in ("wire", "slow")
        for item in items
        if item.get_closest_marker(word) and f"mark.{word}" not in _read(item.path)
    ]


@functools.cache
def _read(path: Path) -> str:
    return path.read_text(encoding="utf-8")


@pytest.fixture
def left_out(request):
    """Return the marked tests that ``make`` would leave out."""
    return request.config.stash[LEFT_OUT]


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    """Turn a run with skipped tests into a failure if ``--fail-on-skip`` is given."""
    reporter = session.config.pluginmanager.get_plugin("terminalreporter")
    if reporter is None or not session.config.getoption("--fail-on-skip"):
        return
    skipped = reporter.stats.get("skipped", [])
    if skipped and exitstatus == pytest.ExitCode.OK:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """List the skipped tests that make the run fail."""
    skipped = terminalreporter.stats.get("skipped", [])
    if skipped and terminalreporter.config.getoption("--fail-on-skip"):
        terminalreporter.section("skipped tests are failures here (--fail-on-skip)")
        for report in skipped:
            terminalreporter.line(f"{report.nodeid}: {report.longrepr[2] if report.longrepr else ''}")


@pytest.fixture(autouse=True)
def kept_priority():
    """Reset the priority after each test: one that runs an agent's thread leaves it at a real-time priority.

    All tests after it, and the processes that they start, would otherwise displace those of the other worker.
    """
    if not hasattr(os, "sched_setscheduler"):
        yield
        return
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    yield
    os.sched_setscheduler(0, *before)


@pytest.fixture(scope="session")
def postgres_server():
    """Provide a private PostgreSQL server."""
    from tests.support.postgres_server import start_server

    server = start_server()
    yield server
    server.remove()


@pytest.fixture(params=["sqlite", "postgresql"])
def catalogue_url(request, tmp_path):
    """Provide the address of an empty catalogue, once in each kind of database."""
    if request.param == "sqlite":
        # Inside the fixture: tests of other packages must not wait for the import of the catalogue.
        from tests.support.empty_catalogues import write_empty_catalogue

        return write_empty_catalogue(tmp_path)
    return request.getfixturevalue("postgres_server").make_catalogue()

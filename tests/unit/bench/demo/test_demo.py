"""Order of what the demonstration prints, and the commands that it runs."""

import io
from contextlib import contextmanager

import pytest
from rich.console import Console

from bench.demo import Demo, DemoFolder, demo
from bench.demo.demo import _run_mrbench
from bench.errors import RunError

PAGE = "http://127.0.0.1:8600/#token=0123456789abcdef0123456789abcdef"


@pytest.fixture
def printed(tmp_path, monkeypatch):
    """Return a function that runs a demonstration without processes; it returns progress and results by line."""

    @contextmanager
    def start_nothing(folder):
        yield PAGE

    monkeypatch.setattr(demo, "start_processes", start_nothing)
    for name in ("cancel_jobs", "print_answer", "print_truth", "print_files"):
        monkeypatch.setattr(demo, name, lambda *given: None)
    monkeypatch.setattr(Demo, "_find_effect", lambda self, api: self._announce("record"))
    monkeypatch.setattr(Demo, "_write_report", lambda self: None)
    monkeypatch.setattr(Demo, "_record_run", lambda self, api, method: None)
    monkeypatch.setattr(demo.signal, "pause", lambda: None)

    def run(*, serve):
        progress, results = (Console(file=io.StringIO(), width=40) for _ in range(2))
        Demo(DemoFolder(tmp_path, "quick", None, 1, ("validation", "multisine")), progress).run(
            results, serve=serve
        )
        return [console.file.getvalue().splitlines() for console in (progress, results)]

    return run


@pytest.mark.parametrize("serve", [False, True])
def test_the_address_comes_unbroken_between_start_and_first_recording(printed, serve):
    steps, _ = printed(serve=serve)
    assert steps[0].startswith("1/")
    assert steps[1] == f"the page is open while the demo runs: {PAGE}"
    assert steps[2].endswith(" record")


def test_the_end_without_serve_says_how_the_page_stays_open(printed):
    _, results = printed(serve=False)
    assert results[-1].endswith("mrbench demo --serve keeps it open, with three recorded runs.")


def test_the_end_with_serve_repeats_the_address_and_records_the_further_runs(printed):
    steps, results = printed(serve=True)
    assert f"the bench keeps running: {PAGE}" in results
    assert "Ctrl-C stops it" in results
    assert not any("--serve" in line for line in results)
    assert [line.split(maxsplit=1)[1] for line in steps[-3:]] == [
        "record validation, a further run to explore",
        "record multisine, a further run to explore",
        "three runs are recorded, and are identified and diagnosed one after the other",
    ]


def test_a_failed_command_ends_the_demonstration_and_a_successful_one_does_not():
    _run_mrbench("--help")
    with pytest.raises(RunError, match="mrbench no_such_command failed"):
        _run_mrbench("no_such_command")

"""Process of the rig, with a double of the served rig."""

import os
import signal
import threading
from types import SimpleNamespace

import pytest

from sim_rig.errors import PlantError, WireError
from sim_rig.scenario import load_scenario
from sim_rig.server import process
from sim_rig.server.bench_toml import write_bench_toml
from sim_rig.server.process import ServerSettings, run_until_stopped
from sim_rig.server.server import TransportOptions

PLAIN = ServerSettings(TransportOptions(), {}, 1.0, poll_period=0.001)


class FakeServer:
    """Double of a served rig: runs an action when it is entered."""

    def __init__(self, action):
        self.rig, self.wires = SimpleNamespace(failure=None), []
        self._happens, self.closed = action, False

    def __enter__(self):
        self._happens(self)
        return self

    def __exit__(self, *_):
        self.closed = True


@pytest.fixture
def run(monkeypatch, tmp_path, varied):
    """Return a function that runs the process with an action on its rig, and returns the rig."""
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    monkeypatch.setattr(threading, "excepthook", threading.excepthook)
    monkeypatch.setattr(process, "_set_realtime_priority", lambda: None)
    monkeypatch.setattr(process, "_reduce_latency", lambda: None)

    def run_with(action, out=tmp_path / "bench.toml"):
        served = FakeServer(action)
        monkeypatch.setattr(process, "RigServer", lambda *_: served)
        try:
            run_until_stopped(varied("default"), out, PLAIN)
        finally:
            run_with.served = served
        return served

    yield run_with
    for number, handler in handlers.items():
        signal.signal(number, handler)


def stop(served):
    os.kill(os.getpid(), signal.SIGTERM)


def test_a_signal_ends_it_after_it_published_its_addresses(run, tmp_path, capsys):
    assert run(stop).closed
    assert "reaches them all" in capsys.readouterr().out


def test_its_file_exists_exactly_as_long_as_its_wires_are_open(run, tmp_path, monkeypatch):
    file, seen = tmp_path / "bench.toml", []
    monkeypatch.setattr(process, "_reduce_latency", lambda: seen.append("[rig]" in file.read_text()))
    monkeypatch.setattr(FakeServer, "__exit__", lambda served, *_: seen.append(file.exists()))
    run(stop)
    assert seen == [True, False]


def test_a_file_written_by_a_person_stays(run, tmp_path):
    file = tmp_path / "bench.toml"
    file.write_text("[rig]")
    with pytest.raises(WireError, match="was written by hand"):
        run(stop)
    assert file.read_text() == "[rig]"


def test_a_diverging_specimen_ends_it_with_the_reason(run):
    def run_away(served):
        served.rig.failure = PlantError("the specimen runs away 0.3 s into its motion")

    with pytest.raises(PlantError, match="runs away"):
        run(run_away)
    assert run.served.closed


def test_an_error_in_a_thread_of_a_wire_ends_it(run):
    def serve():
        raise ZeroDivisionError("a defect of a wire")

    with pytest.raises(ZeroDivisionError, match="a defect of a wire"):
        run(lambda served: threading.Thread(target=serve).start())
    assert run.served.closed


def test_a_file_that_cannot_be_written_is_reported_before_the_wires_open(run, tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "inside").write_text("")
    with pytest.raises(WireError, match=r"cannot be replaced .*; choose another file with --out"):
        run(stop, tmp_path / "folder")
    assert not run.served.closed


def test_the_file_of_an_earlier_rig_is_removed_before_the_wires_open(run, tmp_path):
    write_bench_toml(tmp_path / "bench.toml", [], load_scenario("default"))
    existed = []

    def look(served):
        existed.append((tmp_path / "bench.toml").exists())
        stop(served)

    run(look)
    assert existed == [False]

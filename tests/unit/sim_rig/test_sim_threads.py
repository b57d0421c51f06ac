"""The rig's process, with a rig in place of the real one that does what the test says."""

import os
import signal
import threading
from types import SimpleNamespace

import pytest

from sim_rig import sim_process
from sim_rig.errors import PlantError, WireError
from sim_rig.serve import Choices
from sim_rig.sim_process import Settings, run_until_stopped

PLAIN = Settings(Choices(), {}, 1.0)


class Served:
    """A rig that is served; what happens meanwhile is told."""

    def __init__(self, happens):
        self.rig, self.wires = SimpleNamespace(failure=None), []
        self._happens, self.closed = happens, False

    def __enter__(self):
        self._happens(self)
        return self

    def __exit__(self, *_):
        self.closed = True


@pytest.fixture
def run(monkeypatch, tmp_path, varied):
    """Run the process with a rig to which something happens; the rig, for what became of it."""
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    monkeypatch.setattr(threading, "excepthook", threading.excepthook)
    monkeypatch.setattr(sim_process, "_ahead_of_ordinary_work", lambda: None)
    monkeypatch.setattr(sim_process, "_spare_the_wires", lambda: None)
    monkeypatch.setattr(sim_process, "_LOOK", 0.001)

    def run_with(happens, out=tmp_path / "bench.toml"):
        served = Served(happens)
        monkeypatch.setattr(sim_process, "ServedRig", lambda *_: served)
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


def test_a_signal_ends_it_in_good_order_and_it_has_said_where_everything_is(run, tmp_path, capsys):
    assert run(stop).closed
    assert "reaches them all" in capsys.readouterr().out
    assert "[rig]" in (tmp_path / "bench.toml").read_text()


def test_a_specimen_that_runs_away_ends_it_with_the_reason(run):
    def run_away(served):
        served.rig.failure = PlantError("the specimen runs away 0.3 s into its motion")

    with pytest.raises(PlantError, match="runs away"):
        run(run_away)
    assert run.served.closed


def test_a_wire_whose_thread_breaks_ends_it_and_is_not_taken_for_a_silent_instrument(run):
    def serve():
        raise ZeroDivisionError("a defect of a wire")

    with pytest.raises(ZeroDivisionError, match="a defect of a wire"):
        run(lambda served: threading.Thread(target=serve).start())
    assert run.served.closed


def test_a_place_where_nothing_can_be_written_is_said_before_anything_is_served(run, tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "inside").write_text("")
    with pytest.raises(WireError, match=r"cannot be replaced .*; choose another place with --out"):
        run(stop, tmp_path / "folder")
    assert not run.served.closed


def test_what_an_earlier_rig_has_left_is_gone_before_the_wires_are_open(run, tmp_path):
    (tmp_path / "bench.toml").write_text("ports that are closed")
    seen = []

    def look(served):
        seen.append((tmp_path / "bench.toml").exists())
        stop(served)

    run(look)
    assert seen == [False]

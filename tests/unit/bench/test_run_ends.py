"""One run whose parts do what they should not."""

import itertools
from datetime import UTC, datetime
from types import SimpleNamespace

import pytest
from mcap.reader import make_reader
from recorder_examples import header

from bench.agent import run as running
from bench.agent.header import Document, LogFacts
from bench.agent.run import Order, Run
from bench.methods import compile_method, load_method
from bench.run_from_plant import Identity
from bench.sequencer.plan import RunPlan

DECODERS = Document("decoders.json", "application/json", b"{}")


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.setattr(running, "_LAST_SAMPLES", 0.0)
    ticks = itertools.count()
    identity = Identity("D1", "", datetime.now(UTC))
    order = Order(compile_method(load_method("quick")), 0, identity, tmp_path / "a.mcap")
    bench = SimpleNamespace(newest_ns=0, record=lambda recording: None, finish=dict, lost=dict)
    sequencer = SimpleNamespace(run=lambda programme, first: None, stopped="")
    return Run(order, RunPlan(), sequencer, bench, lambda: next(ticks), lambda *words: None)


def carried_out(run, clocks=dict, tripped=""):
    run.carry_out(LogFacts(header(), [], lambda: DECODERS, clocks), lambda: tripped, {})
    return run.status()


def outcome(run):
    with run.what.path.open("rb") as file:
        return next(one.metadata for one in make_reader(file).iter_metadata() if one.name == "outcome")


def test_a_run_ends_with_an_outcome_and_its_log_with_the_same(run):
    status = carried_out(run)
    assert (status.outcome, status.reason) == ("clean", "")
    assert outcome(run)["outcome"] == "clean"


def test_a_trip_is_the_reason_whatever_it_led_to(run):
    def refused(programme, first):
        raise ZeroDivisionError("division by zero")

    run.sequencer.run = refused
    status = carried_out(run, tripped="force 1600 N")
    assert (status.outcome, status.reason) == ("incomplete", "force 1600 N")


def test_a_defect_while_it_plays_closes_the_log(run):
    def defect(programme, first):
        raise ZeroDivisionError("division by zero")

    run.sequencer.run = defect
    status = carried_out(run)
    assert status.outcome == "incomplete"
    assert "ZeroDivisionError" in status.reason
    assert "ZeroDivisionError" in outcome(run)["reason"]


def test_a_defect_while_its_log_is_closed_leaves_no_run_that_seems_to_go_on(run):
    def clocks():
        raise KeyError("lvdt")

    status = carried_out(run, clocks)
    assert status.outcome == "incomplete"
    assert "does not end in good order: KeyError" in status.reason
    assert outcome(run)["reason"] == status.reason

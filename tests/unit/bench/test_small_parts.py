"""Small parts that all others rely on: faults in words, files that appear whole, processes and signals."""

import os
import queue
import signal
import subprocess
import sys
import threading
from typing import Annotated, Literal

import pytest
import typer
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError, field_validator

from bench.agent import prepare as agent_prepare
from bench.child_process import end, read_along
from bench.commands.prepare import prepare
from bench.errors import LogError
from bench.faults import first_fault
from bench.jobs.errors import WorkerError
from bench.jobs.worker import run_worker, scheduler_of
from bench.recorder.replacement import replacing
from bench.run_on_rig import stopped_by_signals


class Circle(BaseModel):
    """A shape."""

    model_config = ConfigDict(extra="forbid")

    kind: Literal["circle"]
    radius: float = Field(gt=0)

    @field_validator("radius")
    @classmethod
    def _fits(cls, radius):
        if radius > 10:
            raise ValueError(f"radius {radius:g} m does not fit into 10 m")
        return radius


class Square(BaseModel):
    """Another."""

    kind: Literal["square"]


SHAPES = TypeAdapter(Annotated[Circle | Square, Field(discriminator="kind")])


@pytest.mark.parametrize(
    ("document", "words"),
    [
        ({"kind": "circle"}, "is missing"),
        ({"kind": "circle", "radius": 1, "raduis": 2}, "there is no such key; is it spelt right?"),
        ({"kind": "oval"}, "kind 'oval' is none of 'circle', 'square'"),
        ({"kind": "circle", "radius": 11}, "radius 11 m does not fit into 10 m"),
        ({"kind": "circle", "radius": "x", "a": 1, "b": 2}, ".* (and 2 more)"),
    ],
)
def test_a_fault_is_said_to_the_one_who_wrote_it(document, words):
    with pytest.raises(ValidationError) as refused:
        SHAPES.validate_python(document)
    found = first_fault(refused.value)[1]
    assert found == words or (words.startswith(".*") and found.endswith(words.removeprefix(".*")))


def test_a_file_takes_its_place_only_when_it_is_whole(tmp_path):
    (tmp_path / "a.txt").write_text("before")
    with replacing(tmp_path / "a.txt") as beside:
        beside.write_text("after")
        assert (tmp_path / "a.txt").read_text() == "before"
    assert (tmp_path / "a.txt").read_text() == "after"


def test_what_fails_half_way_leaves_what_was_there_and_nothing_else(tmp_path):
    (tmp_path / "a.txt").write_text("before")

    def fail_half_way():
        with replacing(tmp_path / "a.txt") as beside:
            beside.write_text("half")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail_half_way()
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]
    assert (tmp_path / "a.txt").read_text() == "before"


def test_a_folder_that_is_not_there_is_said_before_anything_is_done(tmp_path):
    with pytest.raises(LogError, match=r"there is no folder .*; make it first"), replacing(tmp_path / "no" / "a"):
        pytest.fail("it was begun")


def speaking(code, **more):
    return subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE, text=True, **more)


def test_what_a_process_says_comes_line_by_line_and_then_its_end():
    with speaking("import sys; print('one\\ntwo', file=sys.stderr)") as process:
        lines, reader = read_along(process)
        assert [lines.get(timeout=10) for _ in range(3)] == ["one\n", "two\n", None]
        reader.join(10)
    assert not reader.is_alive()
    with pytest.raises(queue.Empty):
        lines.get_nowait()


@pytest.mark.parametrize(("listens", "status"), [(True, -signal.SIGTERM), (False, -signal.SIGKILL)])
def test_a_process_is_asked_to_end_and_then_ended(listens, status):
    deaf = "" if listens else "signal.signal(signal.SIGTERM, signal.SIG_IGN);"
    with speaking(
        f"import signal, sys, time; {deaf} print('up', file=sys.stderr, flush=True); time.sleep(60)"
    ) as one:
        lines, reader = read_along(one)
        assert lines.get(timeout=10) == "up\n"
        end(one, within=10 if listens else 0.05)
        assert one.returncode == status
        reader.join(10)


def test_a_signal_sets_the_event_and_the_handlers_before_come_back():
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    stopping = threading.Event()
    with stopped_by_signals(stopping):
        os.kill(os.getpid(), signal.SIGTERM)
        assert stopping.wait(10)
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == before


@pytest.mark.parametrize("address", ["nowhere", "tcp://", "tcp://host:port"])
def test_a_worker_without_a_scheduler_s_address_is_refused_before_it_steps_back(address, monkeypatch):
    monkeypatch.setattr(os, "nice", lambda by: pytest.fail("it has begun"))
    with pytest.raises(WorkerError, match="not of the form tcp://HOST:PORT"):
        run_worker(address, 19)


def test_a_worker_finds_the_scheduler_by_the_service_s_folder(tmp_path):
    with pytest.raises(WorkerError, match=r"no service works on .*: start one \(mrbench serve\)"):
        scheduler_of(tmp_path)
    (tmp_path / "scheduler.address").write_text("tcp://127.0.0.1:4567")
    assert scheduler_of(tmp_path) == "tcp://127.0.0.1:4567"


def test_a_move_without_a_place_is_misuse_and_not_a_move_to_zero(monkeypatch, capsys):
    asked = []
    monkeypatch.setattr(agent_prepare, "prepare_through_agent", lambda *given: asked.append(given) or "done")
    with pytest.raises(typer.BadParameter, match="--to METRES"):
        prepare("move")
    assert asked == []
    prepare("move", 0.0)
    prepare("tare")
    with pytest.raises(typer.BadParameter, match="there is no step lubricate; there are home, move, mount"):
        prepare("lubricate")
    with pytest.raises(typer.BadParameter, match="--to says where move goes; home takes none"):
        prepare("home", 0.01)
    assert [(step, place) for _, step, place in asked] == [("move", 0.0), ("tare", None)]

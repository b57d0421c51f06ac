"""Run executor on a rig without wires: the limits of a run, and their restoration however it ends."""

import contextlib
import gc
import tomllib

import pytest

from bench.agent import run_executor as run_executor_module
from bench.agent.run_executor import RunExecutor
from bench.agent.supervisor import SafetySupervisor
from bench.agent_protocol.messages import RunCommand
from bench.config import BenchConfig
from bench.errors import InterlockError, LogError, RunError
from bench.recorder import make_attachments
from bench.rig.acquisition import Acquisition
from bench.rig.instruments import build_rig
from bench.safety.interlocks import Interlocks
from tests.support.fake_rig import BENCH_TOML, EventLog, FakeRecordingThread
from tests.support.methods import constant, method_document, sine

SECOND = 1_000_000_000
METHOD = method_document(sine("a", 0.01, 2.0, constant(0.2)))
"""Its limits are 20 mm and 900 N; those of the fixture 55 mm and 5000 N."""
OUTSIDE_METHOD, OUTSIDE_FIXTURE = 0.03, 0.06
"""[m] Positions beyond the limits of the method and of the fixture."""


class Bench:
    """A run executor with real limits and supervision, and a sequencer that the test replaces."""

    def __init__(self, folder):
        config = BenchConfig.model_validate(tomllib.loads(BENCH_TOML))
        self.now_ns = 0
        self.rig = build_rig(config, self.read_clock, realtime=True)
        self.interlocks = Interlocks(config.limits.make_limit_matrix(), "coil_voltage")
        self.acquisition = Acquisition(
            {one.name: one.instrument for one in self.rig.instruments}, lambda batch: None, lambda *failure: None
        )
        self.acquisition.enable_reconnection()
        self.events = EventLog()
        self.supervisor = SafetySupervisor(
            self.rig, self.interlocks, self.read_clock, self.acquisition.maps, self.events, lambda *stop: None
        )
        self.executor = RunExecutor(
            config, folder / "bench.toml", self.rig, self.interlocks, self.supervisor, self.acquisition,
            FakeRecordingThread(), self.read_clock, self.events,
        )  # fmt: skip
        (folder / "bench.toml").write_text(BENCH_TOML)

    def read_clock(self):
        return self.now_ns

    def prepare(self, play, log):
        """Prepare a run whose sequencer calls a function with the run's supervision instead of playing."""
        prepared = self.executor.prepare(RunCommand(method=METHOD, log=str(log)))
        prepared.run.sequencer.run = lambda programme, first: play(prepared.supervision)
        return prepared

    def is_permitted(self, position):
        try:
            self.interlocks.permit(position=position)
        except InterlockError:
            return False
        return True

    def describe_limits(self):
        """Return everything that a run changes."""
        return {
            "outside method": self.is_permitted(OUTSIDE_METHOD),
            "outside fixture": self.is_permitted(OUTSIDE_FIXTURE),
            "method force": self.interlocks.check_value("force", 950.0, self.now_ns) == [],
            "force age": self.interlocks.compute_force_age(self.now_ns + SECOND),
            "following": self.supervisor._history is not None,
            "may reconnect": self.acquisition._controls.may_reconnect.is_set(),
            "collects garbage": gc.isenabled(),
        }


IDLE = {
    "outside method": True,
    "outside fixture": False,
    "method force": True,
    "force age": 0.0,
    "following": False,
    "may reconnect": True,
    "collects garbage": True,
}
APPROACH = {
    "outside method": True,
    "outside fixture": False,
    "method force": False,
    "force age": 1.0,
    "following": True,
    "may reconnect": False,
    "collects garbage": False,
}


@pytest.fixture
def bench(tmp_path, monkeypatch):
    monkeypatch.setattr(run_executor_module, "_CLOCK_SETTLING_TIME", 0.0)
    monkeypatch.setattr("bench.agent.run._FINAL_SAMPLES_TIMEOUT", 0.0)
    return Bench(tmp_path)


def test_method_limits_apply_during_the_run_and_its_range_from_the_arrival_on(bench, tmp_path):
    limits = []

    def play(supervision):
        limits.append(bench.describe_limits())
        bench.interlocks.reset()  # so that the same violation is reported again
        supervision.on_arrived()
        limits.append(bench.describe_limits())

    assert bench.describe_limits() == IDLE
    prepared = bench.prepare(play, tmp_path / "a.mcap")
    bench.executor.execute(prepared)
    assert limits == [APPROACH, APPROACH | {"outside method": False}]
    bench.interlocks.reset()
    assert bench.describe_limits() == IDLE
    assert prepared.run.get_status().outcome == "clean"


@pytest.mark.parametrize("error", [RunError("refused"), ZeroDivisionError("division by zero")])
@pytest.mark.parametrize("arrived", [False, True])
def test_limits_are_restored_after_an_error(bench, tmp_path, error, arrived):
    def play(supervision):
        if arrived:
            supervision.on_arrived()
        raise error

    prepared = bench.prepare(play, tmp_path / "a.mcap")
    bench.executor.execute(prepared)
    assert bench.describe_limits() == IDLE
    assert prepared.run.get_status().outcome == "incomplete"


def test_limits_are_restored_after_a_trip(bench, tmp_path, monkeypatch):
    monkeypatch.setattr(bench.supervisor, "_bring_to_rest", lambda: None)

    def play(supervision):
        supervision.on_arrived()
        supervision.on_setpoints_failed("actuator: the drive has stopped by itself")

    prepared = bench.prepare(play, tmp_path / "a.mcap")
    bench.executor.execute(prepared)
    assert not bench.is_permitted(0.0)
    assert prepared.run.get_status().reason == "actuator: the drive has stopped by itself"
    bench.interlocks.reset()
    assert bench.describe_limits() == IDLE


def test_limits_are_restored_if_the_log_cannot_be_opened(bench, tmp_path):
    (tmp_path / "a.mcap").mkdir()
    prepared = bench.prepare(lambda supervision: pytest.fail("it was played"), tmp_path / "a.mcap")
    bench.executor.execute(prepared)
    assert bench.describe_limits() == IDLE
    assert prepared.run.get_status().outcome == "incomplete"


def test_limits_are_restored_if_the_supervision_fails_half_way(bench, tmp_path, monkeypatch):
    @contextlib.contextmanager
    def follow(history):
        raise ZeroDivisionError("division by zero")
        yield

    monkeypatch.setattr(bench.supervisor, "follow", follow)
    prepared = bench.prepare(lambda supervision: pytest.fail("it was played"), tmp_path / "a.mcap")
    with pytest.raises(ZeroDivisionError):
        bench.executor.execute(prepared)
    assert bench.describe_limits() == IDLE


def test_limits_are_restored_if_the_execution_raises(bench, tmp_path, monkeypatch):
    prepared = bench.prepare(lambda supervision: None, tmp_path / "a.mcap")
    monkeypatch.setattr(prepared.run, "execute", lambda *_: (_ for _ in ()).throw(LogError("defect")))
    with pytest.raises(LogError):
        bench.executor.execute(prepared)
    assert bench.describe_limits() == IDLE


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ({"method": METHOD | {"drive_kind": "coil_a"}}, "drives by coil_a, this bench by coil_v"),
        ({"method": METHOD, "resume_after": "b"}, "its checkpoints: a"),
    ],
)
def test_preparation_that_fails_leaves_the_limits_unchanged(bench, command, message):
    with pytest.raises(RunError, match=message):
        bench.executor.prepare(RunCommand(**command))
    assert bench.describe_limits() == IDLE


def test_log_is_stored_beside_the_configuration_by_default(bench, tmp_path):
    request = bench.executor.prepare(RunCommand(method=METHOD)).run.request
    assert request.path.parent == tmp_path / "runs"
    assert request.path.name.endswith("-test_method.mcap")


def test_missing_certificate_is_reported_before_anything_moves(bench, tmp_path):
    text = f'{BENCH_TOML}[channels.force]\ncertificate = "none.pdf"\n'
    config = BenchConfig.model_validate(tomllib.loads(text))
    method = bench.executor.prepare(RunCommand(method=METHOD)).run.request.method
    with pytest.raises(RunError, match=r"none\.pdf cannot be read"):
        make_attachments(method, config, bench.rig, tmp_path / "bench.toml")


def test_events_of_the_sequencer_reach_acquisition_and_interlocks(bench, tmp_path):
    supervision = bench.prepare(lambda supervision: None, tmp_path / "a.mcap").supervision
    supervision.on_state("moving")
    supervision.on_setpoints_active(True)
    assert bench.acquisition._controls.externally_triggered.is_set()
    supervision.on_setpoints_active(False)
    assert not bench.acquisition._controls.externally_triggered.is_set()
    supervision.on_late_setpoint(0, 0.025)
    assert bench.events.list_texts("state") == ["moving"]
    assert bench.events.list_texts("alarm") == ["setpoint lateness 25 ms exceeds the limit of 20 ms"]

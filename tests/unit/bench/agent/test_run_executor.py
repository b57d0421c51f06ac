"""Run executor on a rig without wires: the limits of a run, and their restoration however it ends."""

import contextlib
import gc
import shutil
import time
import tomllib
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from types import SimpleNamespace

import pytest

from bench.agent.timing import AgentTiming
from bench.agent_protocol import RunCommand
from bench.calibration import IssuedCertificate, LatestCheck, list_overdue, read_entry, read_failed
from bench.config import BenchConfig
from bench.disk import RESERVE
from bench.errors import LogError, RunError
from bench.methods import load_method
from bench.recorder import make_attachments
from drivers.load_cell import AsciiLoadCell
from tests.support.certificates import issue_certificate
from tests.support.fake_rig import BENCH_TOML, FakeLoadCell
from tests.support.run_bench import METHOD, RunBench

SECOND = 1_000_000_000
NOW = datetime.now(UTC)
OUTSIDE_METHOD, OUTSIDE_FIXTURE = 0.03, 0.06
"""[m] Positions beyond the limits of the method and of the fixture."""
BETWEEN_FORCES = 950.0
"""[N] Force beyond the limit of the method and within that of the fixture."""
REFUSAL = "actuator: the drive has stopped by itself"


def describe_limits(bench):
    """Return everything that a run changes."""
    return {
        "outside method": bench.is_permitted(OUTSIDE_METHOD),
        "outside fixture": bench.is_permitted(OUTSIDE_FIXTURE),
        "method force": bench.interlocks.check_value("force", BETWEEN_FORCES, bench.clock()) == [],
        "force age is limited": bench.interlocks.compute_force_age(bench.clock() + SECOND) > 0,
        "following": bench.supervisor._history is not None,
        "may reconnect": bench.acquisition._controls.may_reconnect.is_set(),
        "collects garbage": gc.isenabled(),
    }


IDLE = {
    "outside method": True,
    "outside fixture": False,
    "method force": True,
    "force age is limited": False,
    "following": False,
    "may reconnect": True,
    "collects garbage": True,
}
APPROACH = {
    "outside method": True,
    "outside fixture": False,
    "method force": False,
    "force age is limited": True,
    "following": True,
    "may reconnect": False,
    "collects garbage": False,
}
STROKE = APPROACH | {"outside method": False}


@pytest.fixture
def bench(tmp_path):
    return RunBench(tmp_path, lambda: 0)


class TestDuringTheRun:
    def test_method_limits_apply_and_its_range_from_the_arrival_on(self, bench, tmp_path):
        limits = []

        def play(supervision):
            limits.append(describe_limits(bench))
            bench.interlocks.reset()  # so that the same violation is reported again
            supervision.on_arrived()
            limits.append(describe_limits(bench))

        assert describe_limits(bench) == IDLE
        prepared = bench.prepare(play, tmp_path / "a.mcap")
        bench.executor.execute(prepared)
        assert limits == [APPROACH, STROKE]
        assert describe_limits(bench) == IDLE
        assert prepared.run.get_status().outcome == "clean"

    def test_events_of_the_sequencer_reach_acquisition_and_interlocks(self, bench, tmp_path):
        supervision = bench.prepare(lambda supervision: None, tmp_path / "a.mcap").supervision
        supervision.on_state("moving")
        supervision.on_setpoints_active(True)
        assert bench.acquisition._controls.externally_triggered.is_set()
        supervision.on_setpoints_active(False)
        assert not bench.acquisition._controls.externally_triggered.is_set()
        supervision.on_late_setpoint(0, 0.025)
        assert bench.events.list_texts("state") == ["moving"]
        assert bench.events.list_texts("alarm") == ["setpoint lateness 25 ms exceeds the limit of 20 ms"]


class TestPlayback:
    """The real sequencer plays on doubles; it is interrupted when the first stroke has started."""

    @pytest.fixture
    def bench(self, tmp_path):
        return RunBench(tmp_path, time.monotonic_ns)

    @staticmethod
    def execute(bench, log, action=lambda: None):
        """Execute a run with an action at the start of its stroke; return its status and the limits then."""
        prepared, limits = bench.prepare_playback(log), []
        read_progress = bench.doubles.amplifier.read_table_progress

        def read_table_progress():
            if not limits:
                limits.append(describe_limits(bench))
                bench.interlocks.reset()  # so that the same violation is reported again
                action()
            return read_progress()

        bench.doubles.amplifier.read_table_progress = read_table_progress
        bench.executor.execute(prepared)
        bench.doubles.amplifier.read_table_progress = read_progress
        return prepared.run.get_status(), limits

    def test_run_to_its_end(self, bench, tmp_path):
        status, limits = self.execute(bench, tmp_path / "a.mcap")
        assert (status.outcome, status.reason, limits) == ("clean", "", [STROKE])
        assert describe_limits(bench) == IDLE

    def test_stop_on_request(self, bench, tmp_path):
        status, limits = self.execute(bench, tmp_path / "a.mcap", lambda: bench.stop("stopped on request"))
        assert (status.outcome, status.reason) == ("incomplete", "stopped on request")
        assert limits == [STROKE]
        assert bench.doubles.calls[-2:] == ["coil safe", "actuator disabled"]
        assert describe_limits(bench) == IDLE

    def test_stop_by_a_limit_of_the_method(self, bench, tmp_path):
        status, _ = self.execute(bench, tmp_path / "a.mcap", lambda: bench.receive_force(BETWEEN_FORCES))
        assert (status.outcome, status.reason) == ("incomplete", "force 950 N exceeds the limit of 900 N")
        assert bench.interlocks.trip_reason == ""
        assert describe_limits(bench) == IDLE
        bench.receive_force(BETWEEN_FORCES)
        assert bench.events.list_texts("alarm") == ["force 950 N exceeds the limit of 900 N"]

    def test_trip_by_a_limit_of_the_method(self, bench, tmp_path):
        status, _ = self.execute(bench, tmp_path / "a.mcap", lambda: bench.receive_force(1200.0))
        assert (status.outcome, status.reason) == ("incomplete", "force 1200 N exceeds the limit of 1125 N")
        assert bench.interlocks.trip_reason == status.reason
        assert {"coil safe", "actuator safe"} <= set(bench.doubles.calls)
        assert not bench.is_permitted(0.0)
        bench.interlocks.reset()
        assert describe_limits(bench) == IDLE

    def test_drive_that_refuses_a_setpoint_trips(self, tmp_path):
        bench = RunBench(tmp_path, time.monotonic_ns, refuses_at=40)
        status, _ = self.execute(bench, tmp_path / "a.mcap")
        assert (status.outcome, status.reason) == ("incomplete", REFUSAL)
        assert bench.interlocks.trip_reason == REFUSAL
        bench.interlocks.reset()
        assert describe_limits(bench) == IDLE

    def test_next_run_after_a_stopped_one_has_its_limits_and_is_clean(self, bench, tmp_path):
        self.execute(bench, tmp_path / "a.mcap", lambda: bench.stop("stopped on request"))
        status, limits = self.execute(bench, tmp_path / "b.mcap")
        assert (status.outcome, limits) == ("clean", [STROKE])
        assert describe_limits(bench) == IDLE


class TestFailure:
    @pytest.mark.parametrize("error", [RunError("refused"), ZeroDivisionError("division by zero")])
    @pytest.mark.parametrize("arrived", [False, True])
    def test_error_during_playback(self, bench, tmp_path, error, arrived):
        def play(supervision):
            if arrived:
                supervision.on_arrived()
            raise error

        prepared = bench.prepare(play, tmp_path / "a.mcap")
        bench.executor.execute(prepared)
        assert describe_limits(bench) == IDLE
        assert prepared.run.get_status().outcome == "incomplete"

    @pytest.mark.parametrize("interrupt", [KeyboardInterrupt, SystemExit])
    def test_interrupt_during_playback(self, bench, tmp_path, interrupt):
        def play(supervision):
            supervision.on_arrived()
            raise interrupt

        prepared = bench.prepare(play, tmp_path / "a.mcap")
        with pytest.raises(interrupt):
            bench.executor.execute(prepared)
        assert describe_limits(bench) == IDLE
        prepared.run.fail("interrupted")

    def test_log_that_cannot_be_opened(self, bench, tmp_path):
        (tmp_path / "a.mcap").mkdir()
        prepared = bench.prepare(lambda supervision: pytest.fail("it was played"), tmp_path / "a.mcap")
        bench.executor.execute(prepared)
        assert describe_limits(bench) == IDLE
        assert prepared.run.get_status().outcome == "incomplete"

    def test_supervision_that_begins_only_in_part(self, bench, tmp_path, monkeypatch):
        @contextlib.contextmanager
        def follow(history):
            raise ZeroDivisionError("division by zero")
            yield

        monkeypatch.setattr(bench.supervisor, "follow", follow)
        prepared = bench.prepare(lambda supervision: pytest.fail("it was played"), tmp_path / "a.mcap")
        with pytest.raises(ZeroDivisionError):
            bench.executor.execute(prepared)
        assert describe_limits(bench) == IDLE

    def test_execution_that_raises(self, bench, tmp_path, monkeypatch):
        prepared = bench.prepare(lambda supervision: None, tmp_path / "a.mcap")
        monkeypatch.setattr(prepared.run, "execute", lambda *_: (_ for _ in ()).throw(LogError("defect")))
        with pytest.raises(LogError):
            bench.executor.execute(prepared)
        assert describe_limits(bench) == IDLE


class TestPreparation:
    @pytest.mark.parametrize(
        ("command", "message"),
        [
            ({"method": METHOD | {"drive_kind": "coil_a"}}, "drives by coil_a, this bench by coil_v"),
            ({"method": METHOD, "resume_after": "b"}, "its checkpoints: a"),
        ],
    )
    def test_refused_command_leaves_the_limits_unchanged(self, bench, command, message):
        with pytest.raises(RunError, match=message):
            bench.executor.prepare(RunCommand(**command))
        assert describe_limits(bench) == IDLE

    def test_log_is_stored_beside_the_configuration_by_default(self, bench, tmp_path):
        request = bench.executor.prepare(RunCommand(method=METHOD)).run.request
        assert request.path.parent == tmp_path / "runs"
        assert request.path.name.endswith("-test_method.mcap")

    def test_missing_certificate_is_reported_before_anything_moves(self, bench, tmp_path):
        text = f'{BENCH_TOML}[channels.force]\ncertificate = "none.pdf"\n'
        config = BenchConfig.model_validate(tomllib.loads(text))
        method = bench.executor.prepare(RunCommand(method=METHOD)).run.request.method
        with pytest.raises(RunError, match=r"none\.pdf cannot be read"):
            make_attachments(method, config, bench.rig, tmp_path / "bench.toml")


class TestCalibration:
    """The coil is driven by its voltage, whose certificate is that of the drive as well."""

    FORCE = issue_certificate("force", "N", number="4711", date="2020-01-01", due="2021-01-01")
    VOLTAGE = issue_certificate("coil_voltage", "V", number="12")
    COMMAND = RunCommand(method=METHOD, certificates=(FORCE, VOLTAGE))
    MARK = "force: calibration overdue since 2021-01-01 (certificate 4711 of PTB Braunschweig)"

    def test_the_log_contains_the_certificates_that_apply(self, bench):
        metadata = bench.executor.prepare(self.COMMAND).metadata
        calibration = metadata.header.calibration
        assert calibration["coil_drive"] == calibration["coil_voltage"]
        assert read_entry(calibration["coil_voltage"])["number"] == "12"
        assert list_overdue(calibration) == [self.MARK]
        assert calibration["displacement"] == "none given"
        attached = {one.name: one.data for one in metadata.attachments}
        assert IssuedCertificate.model_validate_json(attached["certificate-force.json"]) == self.FORCE
        assert "certificate-coil_voltage.json" in attached

    def test_an_overdue_channel_marks_the_run_by_default(self, bench):
        assert bench.executor.prepare(self.COMMAND).run.get_status().calibration_overdue == (self.MARK,)
        valid = RunCommand(method=METHOD, certificates=(self.VOLTAGE,))
        assert bench.executor.prepare(valid).run.get_status().calibration_overdue == ()

    def test_an_overdue_channel_is_refused_by_policy(self, tmp_path):
        bench = RunBench(tmp_path, time.monotonic_ns, f'{BENCH_TOML}[calibration]\noverdue = "refuse"\n')
        with pytest.raises(RunError) as refused:
            bench.executor.prepare(self.COMMAND)
        assert self.MARK in str(refused.value)
        assert 'overdue = "mark"' in str(refused.value)
        assert bench.executor.prepare(RunCommand(method=METHOD, certificates=(self.VOLTAGE,)))

    def test_a_channel_that_is_not_recorded_is_not_judged(self, bench):
        other = issue_certificate("temperature", "degC", date="2020-01-01", due="2021-01-01")
        prepared = bench.executor.prepare(RunCommand(method=METHOD, certificates=(other,)))
        assert prepared.run.get_status().calibration_overdue == ()
        assert "certificate-temperature.json" not in {one.name for one in prepared.metadata.attachments}


class TestChecks:
    """Latest checks of the channels, judged at the start of a run."""

    TEXT = "force: zero check of 2026-01-26 08:00 UTC is out of control: 12 N is above the limit 5.3 N"
    FAILED, FINE = (
        LatestCheck(channel=channel, check="zero", run="check-1", measured=NOW, state=state, text=text)
        for channel, state, text in (
            ("force", "out_of_control", TEXT),
            ("displacement", "in_control", "displacement: zero check is in control"),
        )
    )
    COMMAND = RunCommand(method=METHOD, checks=(FAILED, FINE))

    def test_a_failed_check_marks_log_and_status_by_default(self, bench):
        prepared = bench.executor.prepare(self.COMMAND)
        assert prepared.run.get_status().failed_checks == (self.TEXT,)
        record = prepared.metadata.header.make_metadata()["checks"]
        assert read_failed(record) == [self.TEXT]
        assert read_entry(record["displacement"])["state"] == "in_control"

    def test_a_marked_run_has_an_event(self, bench, tmp_path):
        prepared = bench.executor.prepare(self.COMMAND.model_copy(update={"log": str(tmp_path / "a.mcap")}))
        prepared.run.sequencer.run = lambda programme: None
        bench.executor.execute(prepared)
        assert bench.events.list_texts("check") == [self.TEXT]

    def test_without_known_checks_nothing_is_marked_and_the_log_has_no_record(self, bench):
        prepared = bench.executor.prepare(RunCommand(method=METHOD))
        assert prepared.run.get_status().failed_checks == ()
        assert "checks" not in prepared.metadata.header.make_metadata()

    def test_a_failed_check_is_refused_by_policy_but_a_check_is_not(self, tmp_path):
        toml = f'{BENCH_TOML}[calibration]\nfailed_check = "refuse"\n'
        bench = RunBench(tmp_path, time.monotonic_ns, toml)
        with pytest.raises(RunError) as refused:
            bench.executor.prepare(self.COMMAND)
        assert self.TEXT in str(refused.value)
        assert 'failed_check = "mark"' in str(refused.value)
        assert bench.executor.prepare(RunCommand(method=METHOD, checks=(self.FINE,)))
        zero_check = load_method("zero_check").model_dump(mode="json", by_alias=True)
        prepared = bench.executor.prepare(RunCommand(method=zero_check, checks=(self.FAILED,)))
        assert prepared.run.get_status().failed_checks == ()

    def test_an_interval_makes_an_old_and_a_missing_check_fail(self, tmp_path):
        toml = f"{BENCH_TOML}[calibration]\ncheck_interval_days = 7\n"
        bench = RunBench(tmp_path, time.monotonic_ns, toml)
        old = self.FINE.model_copy(update={"measured": NOW - timedelta(days=10)})
        failed = bench.executor.prepare(RunCommand(method=METHOD, checks=(old,))).run.get_status().failed_checks
        assert "displacement: the latest zero check is 10.0 days old; one is due every 7 days" in failed
        assert "force: no zero check yet; one is due every 7 days" in failed


class TestClocks:
    """Instruments were connected at 100 s of the bench clock."""

    @pytest.fixture
    def now(self):
        return [100 * SECOND]

    @pytest.fixture
    def bench(self, tmp_path, now):
        bench = RunBench(tmp_path, lambda: now[0])
        bench.executor.note_connection()
        return bench

    @pytest.mark.parametrize(("elapsed", "wait"), [(0.0, 4.0), (1.5, 2.5), (4.0, 0.0), (9.0, 0.0)])
    def test_run_waits_until_the_clocks_are_known(self, bench, now, tmp_path, monkeypatch, elapsed, wait):
        waits = []
        monkeypatch.setattr("bench.agent.run_executor.time", SimpleNamespace(sleep=waits.append))
        bench.executor._timing = AgentTiming(clock_settling=4.0)
        prepared = bench.prepare(lambda supervision: None, tmp_path / "a.mcap")
        now[0] += round(elapsed * SECOND)
        bench.executor.execute(prepared)
        assert waits == [pytest.approx(wait)]

    @pytest.mark.parametrize(("elapsed_ns", "rate"), [(0, 0.0), (20 * SECOND - 1, 0.0), (20 * SECOND, 5e-5)])
    def test_rate_of_the_amplifier_counts_after_twenty_seconds(self, bench, now, elapsed_ns, rate):
        bench.acquisition.maps[bench.rig.amplifier.name].estimate_rate = lambda: 5e-5
        now[0] += elapsed_ns
        assert bench.executor._estimate_amplifier_rate() == rate


def test_a_run_whose_log_does_not_fit_is_refused_before_anything_moves(tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "disk_usage", lambda path: SimpleNamespace(free=RESERVE))
    bench = RunBench(tmp_path, time.monotonic_ns)
    with pytest.raises(
        RunError, match=r"needs up to 0\.00\d GB and 0\.100 GB stay in reserve; nothing was started"
    ):
        bench.prepare(lambda supervision: None, tmp_path / "a.mcap")
    assert not (tmp_path / "a.mcap").exists()
    assert bench.doubles.calls == []


class TestShunt:
    """Methods that need the shunt of the load cell, before anything moves."""

    METHOD = load_method("shunt_check").model_dump(mode="json", by_alias=True)

    def make_bench(self, folder, cell, toml=BENCH_TOML):
        bench = RunBench(folder, time.monotonic_ns, toml)
        bench.executor._rig = replace(bench.rig, load_cell=cell)
        return bench

    def test_a_load_cell_with_a_shunt_can_play_it(self, tmp_path):
        cell = FakeLoadCell()
        prepared = self.make_bench(tmp_path, cell).executor.prepare(RunCommand(method=self.METHOD))
        assert [one.name for one in prepared.run.request.programme.segments if one.shunt] == ["shunt"]
        assert cell.calls == ["shunt off"]

    def test_a_load_cell_without_a_shunt_is_refused(self, tmp_path):
        bench = self.make_bench(tmp_path, AsciiLoadCell("indicator", "/dev/null", time.monotonic_ns))
        with pytest.raises(RunError, match=r"method shunt_check, segment shunt: .* indicator: .* has no shunt"):
            bench.executor.prepare(RunCommand(method=self.METHOD))
        assert bench.executor.prepare(RunCommand(method=METHOD))

    def test_a_load_cell_that_does_not_reply_is_refused(self, bench):
        with pytest.raises(RunError, match="the shunt of the load cell cannot be switched: cell"):
            bench.executor.prepare(RunCommand(method=self.METHOD))

    @pytest.mark.parametrize(("force", "limit"), [(1501.0, 1500), (1300.0, 1200)])
    def test_more_force_than_a_limit_of_method_or_bench_is_refused(self, tmp_path, force, limit):
        toml = f"{BENCH_TOML}[limits.force]\ncontrolled_stop = {limit}\ntrip = 5000\n"
        bench = self.make_bench(tmp_path, FakeLoadCell(force=force), toml if limit < 1500 else BENCH_TOML)
        with pytest.raises(RunError, match=f"force {force:.4g} N exceeds the limit of {limit} N"):
            bench.executor.prepare(RunCommand(method=self.METHOD))

    def test_a_shunt_check_is_not_refused_for_a_failed_check(self, tmp_path):
        toml = f'{BENCH_TOML}[calibration]\nfailed_check = "refuse"\n'
        command = RunCommand(method=self.METHOD, checks=(TestChecks.FAILED,))
        assert self.make_bench(tmp_path, FakeLoadCell(), toml).executor.prepare(command)

"""A run from the plant, with a rig that answers at once: what goes into the log, and what stays out."""

import json
from datetime import UTC, datetime

import numpy as np
import pytest

from bench.errors import MethodError, RunError
from bench.log.reader import Log, read_log
from bench.log.header import Identity
from bench.methods import Method, load_method
from bench.runs import from_plant as module
from bench.runs.from_plant import run_from_plant
from bench.runs.plant_process import RigChannels

IDENTITY = Identity("MR-7", "Ada", datetime(2030, 1, 2, 3, 4, 5, tzinfo=UTC))
NOBODY = Identity("", "", IDENTITY.started)
INFO = {
    "channels": {"force": {"unit": "N", "rate_hz": 1000, "filter": None, "delay_s": 1e-4, "more": 1}},
    "clocks": {"daq": {"ppm": 40}},
    "drive_kind": "coil_v",
    "drive_unit": "V",
    "specimen": {"name": "lab damper", "serial": "001"},
}


def answering(lost: dict[str, slice] | None = None, **changes: object):
    """A rig whose force is 1000 times the drive, and that loses some readings."""

    def play(scenario, commands, progress, rig):
        progress(1.0)
        channels = {
            "time": commands["time"],
            "displacement": commands["displacement"].copy(),
            "force": 1000 * commands["drive"],
            "coil_drive": commands["drive"].copy(),
            "temperature": np.full(len(commands["time"]), 23.0),
            "gossip": commands["time"],
        }
        for name, away in (lost or {}).items():
            channels[name][away] = np.nan
        return RigChannels(channels, INFO | changes)

    return play


@pytest.fixture(scope="module")
def method() -> Method:
    quick = load_method("quick")
    segments = (quick.segments[0].model_copy(update={"checkpoint": True}),)
    limits = quick.limits.model_copy(update={"force_n": 450.0})
    return quick.model_copy(update={"segments": segments, "limits": limits})


@pytest.fixture(scope="module")
def log(method, tmp_path_factory) -> Log:
    out = tmp_path_factory.mktemp("run") / "run.mcap"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "play", answering())
        run_from_plant(method, "some/where/secret.json", out, IDENTITY)
    return read_log(out)


def test_every_sample_is_recorded_with_command_and_measurement(log):
    assert log.outcome == "clean"
    samples = log.samples
    assert samples["force"] == pytest.approx(1000 * samples["coil_drive_command"])
    assert samples["displacement_command"] == pytest.approx(samples["displacement"])
    assert set(samples["temperature"]) == {23.0}
    assert samples["time"][-1] == pytest.approx(7.5)
    assert "gossip" not in samples


def test_velocity_is_that_of_the_displacement(log):
    numerical = np.gradient(log.samples["displacement"], 1e-3)
    assert np.abs(log.samples["velocity"] - numerical).max() < 2e-3


def test_segments_are_marked_where_their_samples_stand(log):
    assert [one.name for one in log.segments][:2] == ["10mm_1Hz_0.3V", "10mm_1Hz_0V"]
    for segment in log.segments:
        assert set(log.samples["segment"][segment.start : segment.stop]) == {segment.index}
        assert segment.stretch == "quick"
        assert (segment.amplitude, segment.frequency) == (0.01, 1.0)
        assert set(log.samples["coil_drive"][segment.start : segment.stop]) == {segment.drive_value}


def test_the_course_of_the_run_is_in_its_events(log):
    kinds = [(event["kind"], event["text"]) for event in log.events]
    assert kinds[0] == ("state", "run of method quick started")
    assert kinds[1] == ("state", "segment 10mm_1Hz_0.3V started")
    assert ("checkpoint", "after segment 10mm_1Hz_0.2V") in kinds
    assert kinds[-1] == ("state", "run finished")


def test_a_force_beyond_the_limit_is_an_alarm_where_it_first_happens(log):
    alarm = next(event for event in log.events if event["kind"] == "alarm")
    assert alarm["text"] == "force 500.0 N exceeds the method's limit of 450 N"
    assert (alarm["quantity"], alarm["value"], alarm["limit"]) == ("force", 500.0, 450.0)
    fifth = log.segments[4]
    assert alarm["timestamp"]["sec"] == int(log.samples["time"][fifth.start])


def test_the_log_says_whose_run_it_is_and_how_its_channels_were_taken(log):
    run = log.metadata["run"]
    assert run["id"] == "20300102T030405.000000Z-quick"
    assert (run["specimen"], run["operator"], run["source"]) == ("MR-7", "Ada", "run")
    assert run["utc_offset"] == "2030-01-02T03:04:05+00:00"
    assert json.loads(log.metadata["channels"]["force"])["delay_s"] == 1e-4
    assert json.loads(log.metadata["clocks"]["daq"]) == {"ppm": 40}
    assert log.metadata["units"]["velocity_from"] == "smoothed displacement"


def test_the_method_is_attached_and_of_the_scenario_only_its_name(log, method):
    assert Method.model_validate_json(log.attachments["method.json"]) == method
    assert log.attachments["scenario.txt"] == b"secret\n"
    assert "README.txt" in log.attachments


def test_without_a_name_the_specimen_is_what_the_rig_reports(method, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "play", answering())
    run_from_plant(method, "any", tmp_path / "run.mcap", NOBODY)
    assert read_log(tmp_path / "run.mcap").metadata["run"]["specimen"] == "lab damper, 001"


def test_samples_that_the_rig_lost_are_left_out_and_counted(method, tmp_path, monkeypatch):
    lost = {"force": slice(900, 1100), "displacement": slice(3000, 3010), "temperature": slice(0, 5)}
    monkeypatch.setattr(module, "play", answering(lost))
    run_from_plant(method, "any", tmp_path / "run.mcap", NOBODY)
    log = read_log(tmp_path / "run.mcap")
    assert log.outcome == "lossy"
    assert json.loads(log.metadata["outcome"]["lost"]) == {"force": 200, "displacement": 10, "temperature": 5}
    assert len(log.samples["time"]) == 7501 - 210
    assert [one.stop - one.start for one in log.segments] == [900, 1000, 990, 1000, 1000, 1000]
    assert np.isnan(log.samples["temperature"]).sum() == 5


def test_a_rig_that_loses_all_displacement_leaves_no_log(method, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "play", answering({"displacement": slice(None)}))
    with pytest.raises(RunError, match="lost every reading of displacement"):
        run_from_plant(method, "any", tmp_path / "run.mcap", NOBODY)
    assert not list(tmp_path.iterdir())


def test_a_rig_that_is_driven_otherwise_is_refused(method, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "play", answering(drive_unit="A", drive_kind="coil_a"))
    with pytest.raises(RunError, match="method quick drives in V, the scenario any in A; take a method with"):
        run_from_plant(method, "any", tmp_path / "run.mcap", NOBODY)
    assert not list(tmp_path.iterdir())


def test_a_log_in_a_folder_that_does_not_exist_is_refused_before_anything_runs(method, tmp_path):
    with pytest.raises(RunError, match="there is no folder"):
        run_from_plant(method, "any", tmp_path / "gone" / "run.mcap", NOBODY)


def test_a_method_beyond_its_limits_is_refused_before_anything_runs(method, tmp_path):
    tight = method.model_copy(update={"limits": method.limits.model_copy(update={"stroke_m": 0.001})})
    with pytest.raises(MethodError, match=r"exceeds the limit of 0\.001 m"):
        run_from_plant(tight, "any", tmp_path / "run.mcap", NOBODY)

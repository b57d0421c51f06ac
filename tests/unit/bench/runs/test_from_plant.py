"""Run on the simulated plant, with a double of the rig: content of the log, and refused runs."""

import json
from datetime import UTC, datetime

import numpy as np
import pytest

from bench.errors import MethodError, RunError
from bench.log.header import Identity
from bench.log.reader import Log, read_log
from bench.methods import Method, load_method
from bench.runs import from_plant as module
from bench.runs.from_plant import run_from_plant
from bench.runs.plant_process import RigChannels

IDENTITY = Identity("MR-7", "Ada", datetime(2030, 1, 2, 3, 4, 5, tzinfo=UTC))
UNNAMED = Identity("", "", IDENTITY.started)
INFO = {
    "channels": {"force": {"unit": "N", "rate_hz": 1000, "filter": None, "delay_s": 1e-4, "more": 1}},
    "clocks": {"daq": {"ppm": 40}},
    "drive_kind": "coil_v",
    "drive_unit": "V",
    "specimen": {"name": "lab damper", "serial": "001"},
}


def make_rig(lost: dict[str, slice] | None = None, **changes: object):
    """Return a double of the rig whose force is 1000 times the drive, and that loses some readings."""

    def play(scenario, commands, progress, rig):
        progress(1.0)
        channels = {
            "time": commands["time"],
            "displacement": commands["displacement"].copy(),
            "force": 1000 * commands["drive"],
            "coil_drive": commands["drive"].copy(),
            "temperature": np.full(len(commands["time"]), 23.0),
            "unknown_channel": commands["time"],
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
        patch.setattr(module, "play_scenario", make_rig())
        run_from_plant(method, "some/where/secret.json", out, IDENTITY)
    return read_log(out)


def test_every_sample_contains_command_and_measurement(log):
    assert log.outcome == "clean"
    samples = log.samples
    assert samples["force"] == pytest.approx(1000 * samples["coil_drive_command"])
    assert samples["displacement_command"] == pytest.approx(samples["displacement"])
    assert set(samples["temperature"]) == {23.0}
    assert samples["time"][-1] == pytest.approx(7.5)
    assert "unknown_channel" not in samples


def test_velocity_is_the_derivative_of_the_displacement(log):
    numerical = np.gradient(log.samples["displacement"], 1e-3)
    assert np.abs(log.samples["velocity"] - numerical).max() < 2e-3


def test_segment_marks_enclose_their_samples(log):
    assert [one.name for one in log.segments][:2] == ["10mm_1Hz_0.3V", "10mm_1Hz_0V"]
    for segment in log.segments:
        assert set(log.samples["segment"][segment.start : segment.stop]) == {segment.index}
        assert segment.stretch == "quick"
        assert (segment.amplitude, segment.frequency) == (0.01, 1.0)
        assert set(log.samples["coil_drive"][segment.start : segment.stop]) == {segment.drive_value}


def test_events_describe_the_course_of_the_run(log):
    kinds = [(event["kind"], event["text"]) for event in log.events]
    assert kinds[0] == ("state", "run of method quick started")
    assert kinds[1] == ("state", "segment 10mm_1Hz_0.3V started")
    assert ("checkpoint", "after segment 10mm_1Hz_0.2V") in kinds
    assert kinds[-1] == ("state", "run finished")


def test_first_force_beyond_the_limit_is_an_alarm(log):
    alarm = next(event for event in log.events if event["kind"] == "alarm")
    assert alarm["text"] == "force 500.0 N exceeds the method's limit of 450 N"
    assert (alarm["quantity"], alarm["value"], alarm["limit"]) == ("force", 500.0, 450.0)
    fifth = log.segments[4]
    assert alarm["timestamp"]["sec"] == int(log.samples["time"][fifth.start])


def test_metadata_describe_run_and_channels(log):
    run = log.metadata["run"]
    assert run["id"] == "20300102T030405.000000Z-quick"
    assert (run["specimen"], run["operator"], run["source"]) == ("MR-7", "Ada", "run")
    assert run["utc_offset"] == "2030-01-02T03:04:05+00:00"
    assert json.loads(log.metadata["channels"]["force"])["delay_s"] == 1e-4
    assert json.loads(log.metadata["clocks"]["daq"]) == {"ppm": 40}
    assert log.metadata["units"]["velocity_from"] == "smoothed displacement"


def test_method_and_name_of_the_scenario_are_attached(log, method):
    assert Method.model_validate_json(log.attachments["method.json"]) == method
    assert log.attachments["scenario.txt"] == b"secret\n"
    assert "README.txt" in log.attachments


def test_specimen_without_a_name_is_named_by_the_rig(method, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "play_scenario", make_rig())
    run_from_plant(method, "any", tmp_path / "run.mcap", UNNAMED)
    assert read_log(tmp_path / "run.mcap").metadata["run"]["specimen"] == "lab damper, 001"


def test_lost_samples_are_omitted_and_counted(method, tmp_path, monkeypatch):
    lost = {"force": slice(900, 1100), "displacement": slice(3000, 3010), "temperature": slice(0, 5)}
    monkeypatch.setattr(module, "play_scenario", make_rig(lost))
    run_from_plant(method, "any", tmp_path / "run.mcap", UNNAMED)
    log = read_log(tmp_path / "run.mcap")
    assert log.outcome == "lossy"
    assert json.loads(log.metadata["outcome"]["lost"]) == {"force": 200, "displacement": 10, "temperature": 5}
    assert len(log.samples["time"]) == 7501 - 210
    assert [one.stop - one.start for one in log.segments] == [900, 1000, 990, 1000, 1000, 1000]
    assert np.isnan(log.samples["temperature"]).sum() == 5


def test_loss_of_all_displacement_leaves_no_log(method, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "play_scenario", make_rig({"displacement": slice(None)}))
    with pytest.raises(RunError, match="lost every reading of displacement"):
        run_from_plant(method, "any", tmp_path / "run.mcap", UNNAMED)
    assert not list(tmp_path.iterdir())


def test_rig_with_another_drive_unit_is_refused(method, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "play_scenario", make_rig(drive_unit="A", drive_kind="coil_a"))
    with pytest.raises(RunError, match="method quick drives in V, the scenario any in A; use a method with"):
        run_from_plant(method, "any", tmp_path / "run.mcap", UNNAMED)
    assert not list(tmp_path.iterdir())


def test_missing_folder_of_the_log_is_refused_before_the_run(method, tmp_path):
    with pytest.raises(RunError, match=r"the folder .* does not exist; create it first"):
        run_from_plant(method, "any", tmp_path / "gone" / "run.mcap", UNNAMED)


def test_method_beyond_its_limits_is_refused_before_the_run(method, tmp_path):
    tight = method.model_copy(update={"limits": method.limits.model_copy(update={"stroke_m": 0.001})})
    with pytest.raises(MethodError, match=r"exceeds the limit of 0\.001 m"):
        run_from_plant(tight, "any", tmp_path / "run.mcap", UNNAMED)


def test_shunt_of_the_load_cell_is_commanded_and_marked(tmp_path, monkeypatch):
    given = {}

    def play(scenario, commands, progress, rig):
        given.update(commands)
        return make_rig()(scenario, commands, progress, rig)

    monkeypatch.setattr(module, "play_scenario", play)
    programme = run_from_plant(load_method("shunt_check"), "any", tmp_path / "run.mcap", IDENTITY)
    shunt = next(one for one in programme.segments if one.shunt)
    assert np.flatnonzero(given["shunt"]).tolist() == list(range(shunt.start, shunt.stop))
    assert {one.name: one.shunt for one in read_log(tmp_path / "run.mcap").segments} == {
        "settle": False, "rest": False, "shunt": True, "rest_after": False
    }  # fmt: skip
    given.clear()
    run_from_plant(load_method("zero_check"), "any", tmp_path / "run.mcap", IDENTITY)
    assert "shunt" not in given

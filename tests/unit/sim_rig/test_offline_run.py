import json
import subprocess
import sys

import numpy as np
import pytest

from sim_rig.errors import CommandsError
from sim_rig.offline_run import make_device_info, read_commands
from sim_rig.sensors.channels import CHANNELS


def sim_rig(*words):
    return subprocess.run(
        [sys.executable, "-m", "sim_rig", *map(str, words)], capture_output=True, text=True, timeout=120
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory, strokes):
    path = tmp_path_factory.mktemp("play")
    np.savez(path / "commands.npz", **strokes._asdict())
    return path


@pytest.fixture(scope="module")
def run(folder):
    return sim_rig(
        *("play", "--scenario", "default", "--commands", folder / "commands.npz", "--seed", 3),
        *("--out", folder / "channels.npz", "--truth", folder / "truth.npz"),
    )


def test_a_run_reports_its_progress_on_standard_error(run):
    assert run.returncode == 0, run.stderr
    assert [json.loads(line) for line in run.stderr.splitlines()] == [{"progress": 1.0}]


def test_channels_are_on_the_clock_of_the_commands(run, folder, strokes):
    with np.load(folder / "channels.npz") as channels:
        assert set(channels) == {"time", "info", *CHANNELS}
        assert np.array_equal(channels["time"], strokes.time)
        assert all(channels[name].shape == (3000,) for name in CHANNELS)
        assert all(np.isfinite(channels[name]).all() for name in CHANNELS)
        assert 100 < np.std(channels["force"]) < 500


def test_info_is_what_the_devices_report(run, folder):
    with np.load(folder / "channels.npz") as channels:
        info = json.loads(str(channels["info"]))
    assert info["channels"].keys() == CHANNELS.keys()
    assert (info["drive_kind"], info["drive_unit"]) == ("coil_v", "V")
    assert info["channels"]["coil_drive"]["unit"] == "V"
    assert info["clocks"]["load_cell"] == {"ppm": 47.0, "mapping_std_s": 1e-5}


def test_the_truth_contains_what_no_log_may_contain(run, folder):
    with np.load(folder / "truth.npz") as truth:
        hidden = json.loads(str(truth["info"]))
        assert {"damper_displacement", "damper_velocity", "force", "y", "z", "field"} <= set(truth)
    assert hidden["parameters"]["eta"] == pytest.approx(80.0)
    assert hidden["recorded_f0"] == pytest.approx(16.0 - hidden["channel_errors"]["force"]["zero"])


@pytest.mark.parametrize("name", ["default", "seal_friction", "lord_class"])
def test_info_hides_the_truth(varied, name):
    scenario = varied(name)
    info = json.dumps(make_device_info(scenario, 1000.0))
    keys = {"noise", "resolution", "zero", "effects", "seed", "stiffness", "damper", *scenario.parameters._fields}
    assert not any(f'"{key}":' in info for key in keys)
    assert not any(effect.name in info for effect in scenario.effects)


def test_the_seed_of_the_command_line_replaces_that_of_the_scenario(run, folder):
    words = ("play", "--scenario", "default", "--commands", folder / "commands.npz")
    again = sim_rig(*words, "--out", folder / "again.npz", "--seed", 3)
    assert again.returncode == 0
    with np.load(folder / "channels.npz") as first, np.load(folder / "again.npz") as second:
        assert np.array_equal(first["force"], second["force"])


@pytest.mark.parametrize(
    ("scenario", "commands", "message"),
    [
        ("nowhere", "commands.npz", "no scenario nowhere: neither a file nor one of"),
        ("default", "no.npz", "no.npz: is not a readable npz file"),
    ],
)
def test_invalid_input_exits_with_1_and_one_line_and_writes_nothing(folder, scenario, commands, message):
    out = folder / "never.npz"
    failed = sim_rig("play", "--scenario", scenario, "--commands", folder / commands, "--out", out)
    assert failed.returncode == 1
    assert message in failed.stderr
    assert failed.stderr.count("\n") == 1
    assert not out.exists()


def test_misuse_exits_with_2():
    assert sim_rig("play", "--scenario", "default").returncode == 2


TIME = np.arange(100) * 1e-3
BAD = {
    "a missing array": ({"time": TIME, "drive": TIME}, "displacement"),
    "two lengths": ({"time": TIME, "displacement": TIME[:50], "drive": TIME}, "differ in shape"),
    "too few": ({"time": TIME[:5], "displacement": TIME[:5], "drive": TIME[:5]}, "5 samples; at least 10"),
    "a shunt of another length": (
        {"time": TIME, "displacement": TIME, "drive": TIME, "shunt": TIME[:50]},
        "differ in shape",
    ),
    "NaN": (
        {"time": TIME, "displacement": TIME, "drive": np.where(TIME > 0.05, np.nan, 0)},
        "drive is not finite at",
    ),
    "uneven time": ({"time": TIME**2 + TIME, "displacement": TIME, "drive": TIME}, "time is not uniform"),
    "decreasing time": ({"time": -TIME, "displacement": TIME, "drive": TIME}, "time is not uniform"),
    "a rate out of range": ({"time": TIME * 1e3, "displacement": TIME, "drive": TIME}, "1 Hz is outside 50 to"),
}


@pytest.mark.parametrize("case", BAD)
def test_invalid_commands_are_refused(tmp_path, case):
    arrays, message = BAD[case]
    np.savez(tmp_path / "commands.npz", **arrays)
    with pytest.raises(CommandsError, match=message):
        read_commands(tmp_path / "commands.npz")


def test_a_file_that_is_not_npz_is_refused(tmp_path):
    (tmp_path / "commands.npz").write_text("time,displacement,drive")
    with pytest.raises(CommandsError, match="is not a readable npz file"):
        read_commands(tmp_path / "commands.npz")


@pytest.mark.parametrize(
    ("samples", "step", "error", "accepted"),
    [
        (9, 1e-3, 0.0, False),
        (10, 1e-3, 0.0, True),
        (100, 1e-3, 0.9e-6, True),  # 0.09 % of a step
        (100, 1e-3, 1.1e-6, False),
        (100, 0.02, 0.0, True),  # 50 Hz
        (100, 0.0201, 0.0, False),
    ],
)
def test_commands_are_at_least_ten_at_a_uniform_rate_of_50_hz_or_more(tmp_path, samples, step, error, accepted):
    time = np.arange(samples) * step
    time[5] += error
    path = tmp_path / "commands.npz"
    np.savez(path, time=time, displacement=time, drive=time)
    if accepted:
        assert len(read_commands(path).time) == samples
    else:
        with pytest.raises(CommandsError):
            read_commands(path)

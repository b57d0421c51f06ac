"""``mrbench run`` as a process."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from bench.log.reader import read_log

COMMAND = Path(sys.executable).parent / "mrbench"


def mrbench(*words: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([COMMAND, *map(str, words)], capture_output=True, text=True, timeout=250)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    out = tmp_path_factory.mktemp("run") / "quick.mcap"
    done = mrbench("run", "quick", "--scenario", "default", "--out", out, "--specimen", "MR-7")
    return done, out


def test_a_run_from_the_plant_writes_a_clean_log(recorded):
    done, out = recorded
    assert done.returncode == 0, done.stderr
    assert done.stderr.strip() == f"{out}: 13 segments, 23.1 s, 23101 samples"
    log = read_log(out)
    assert log.outcome == "clean"
    assert len(log.segments) == 13
    assert log.metadata["run"]["specimen"] == "MR-7"


def test_the_recorded_damper_dissipates_and_its_force_grows_with_the_drive(recorded):
    log = read_log(recorded[1])
    force, velocity = log.samples["force"], log.samples["velocity"]
    assert np.mean(force * velocity) > 0
    rms = {one.drive_value: np.std(force[one.start : one.stop]) for one in log.segments if one.amplitude == 0.01}
    sizes = [rms[drive] for drive in sorted(rms)]
    assert sizes == sorted(sizes)


def test_the_log_contains_no_hidden_value_of_the_scenario(recorded):
    log = read_log(recorded[1])
    content = json.dumps([log.metadata, log.events]) + str(log.attachments)
    for hidden in ("alpha", "c0_a", "F_a", "noise", "effects"):
        assert hidden not in content


def test_a_failing_rig_gives_a_one_line_message_and_keeps_an_older_log(tmp_path):
    out = tmp_path / "run.mcap"
    out.write_bytes(b"an older log")
    done = mrbench("run", "quick", "--scenario", "nonsense", "--out", out)
    assert done.returncode == 1
    assert done.stderr.startswith("mrbench: the simulated rig failed: ")
    assert done.stderr.count("\n") == 1
    assert out.read_bytes() == b"an older log"
    assert [one.name for one in tmp_path.iterdir()] == ["run.mcap"]


def test_a_dry_run_prints_the_envelope_and_writes_nothing(tmp_path):
    done = mrbench("run", "quick", "--dry-run", "--out", tmp_path / "run.mcap")
    assert done.returncode == 0
    assert "within limits" in done.stdout
    assert not list(tmp_path.iterdir())


def test_a_dry_run_prints_json_on_request():
    done = mrbench("run", "quick", "--dry-run", "--out", "-")
    assert json.loads(done.stdout)["verdict"] == "within limits"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "--scenario NAME or FILE, and --dry-run"),
        (("--scenario", "default", "--out", "-"), "a log cannot be printed"),
    ],
)
def test_each_misuse_has_its_own_message(words, message):
    done = mrbench("run", "quick", *words)
    assert done.returncode == 2
    assert message in done.stderr

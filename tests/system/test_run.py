"""`mrbench run`, as a person would call it."""

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


def test_a_run_from_the_plant_leaves_a_clean_log(recorded):
    done, out = recorded
    assert done.returncode == 0, done.stderr
    assert done.stderr.strip() == f"{out}: 13 segments, 23.1 s, 23101 samples"
    log = read_log(out)
    assert log.outcome == "clean"
    assert len(log.segments) == 13
    assert log.metadata["run"]["specimen"] == "MR-7"


def test_the_recorded_damper_resists_and_resists_more_with_more_drive(recorded):
    log = read_log(recorded[1])
    force, velocity = log.samples["force"], log.samples["velocity"]
    assert np.mean(force * velocity) > 0
    rms = {one.drive_value: np.std(force[one.start : one.stop]) for one in log.segments if one.amplitude == 0.01}
    sizes = [rms[drive] for drive in sorted(rms)]
    assert sizes == sorted(sizes)


def test_the_log_holds_nothing_of_what_the_scenario_hides(recorded):
    log = read_log(recorded[1])
    said = json.dumps([log.metadata, log.events]) + str(log.attachments)
    for hidden in ("alpha", "c0_a", "F_a", "noise", "effects"):
        assert hidden not in said


def test_a_rig_that_fails_costs_one_line_and_leaves_an_older_log_alone(tmp_path):
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


def test_a_dry_run_prints_json_where_asked():
    done = mrbench("run", "quick", "--dry-run", "--out", "-")
    assert json.loads(done.stdout)["verdict"] == "within limits"


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ((), "--scenario NAME or FILE, or --dry-run"),
        (("--scenario", "default", "--out", "-"), "a log goes to a file"),
    ],
)
def test_misuse_is_told_apart(words, complaint):
    done = mrbench("run", "quick", *words)
    assert done.returncode == 2
    assert complaint in done.stderr

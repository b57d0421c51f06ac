"""`mrbench demo`, as a person would call it."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from bench.agent.link import AgentClient
from bench.agent.messages import StatusCommand
from bench.errors import AgentUnreachable
from bench.recorder.reader import read_log
from bench.rig.config import load_config

pytestmark = pytest.mark.wire
COMMAND = Path(sys.executable).parent / "mrbench"


def mrbench(*words):
    return subprocess.run([COMMAND, *map(str, words)], capture_output=True, text=True, timeout=280)


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    folder = tmp_path_factory.mktemp("demo") / "quick"
    return mrbench("demo", "--quick", "--out", folder), folder


def test_the_demo_leaves_log_fit_report_and_plots(demo):
    done, folder = demo
    assert done.returncode == 0, done.stderr
    assert {"quick.mcap", "fit.json", "report.html", "plots", "bench.toml"} <= {
        one.name for one in folder.iterdir()
    }
    assert len(list((folder / "plots").glob("*.svg"))) == 5


def test_each_step_is_announced_on_standard_error(demo):
    announced = [line for line in demo[0].stderr.splitlines() if line[1:3] == "/4"]
    assert announced == [
        "1/4 bring up simulated rig, agent, service and worker",
        "2/4 record quick over the wires",
        "3/4 identify the damper",
        "4/4 write the report",
    ]


def test_the_log_was_recorded_over_the_wires_and_is_clean(demo):
    log = read_log(demo[1] / "quick.mcap")
    assert log.outcome == "clean"
    assert "decoders.json" in log.attachments


def test_nothing_is_left_running(demo):
    agent = load_config(demo[1] / "bench.toml").agent
    with pytest.raises(AgentUnreachable):
        AgentClient(agent.commands, agent.samples).send(StatusCommand(), timeout=0.5)


def test_the_numbers_printed_are_those_of_the_fit(demo):
    done, folder = demo
    fit = json.loads((folder / "fit.json").read_text())
    rmse, floor = fit["rmse_n"]["train"], fit["noise_floor_n"]
    said = [line.split() for line in done.stdout.splitlines()]
    assert ["fitted", f"{rmse:.2f}", "N", f"{floor:.2f}", "N", f"{rmse / floor:.2f}", "times"] in said
    rows = {words[0]: words[1:] for words in said if words}
    for name, estimate in fit["coordinates"].items():
        shown = float(rows[name][0].lstrip("([").replace("−", "-")) * (1e-6 if "µm" in rows[name] else 1.0)
        assert shown == pytest.approx(estimate["value"], rel=0.05)


def test_the_files_named_exist(demo):
    done, folder = demo
    named = [Path(word) for word in done.stdout.split() if word.startswith(str(folder))]
    assert len(named) == 4
    assert all(path.exists() for path in named)


def test_the_report_of_the_demo_says_that_its_recording_was_fitted(demo):
    html = (demo[1] / "report.html").read_text()
    assert "made from another recording" not in html
    assert "The law repeats the recorded force to" in html


def test_a_step_that_fails_ends_the_demo_with_its_own_line(tmp_path):
    (tmp_path / "demo" / "rig.toml").mkdir(parents=True)
    done = mrbench("demo", "--quick", "--out", tmp_path / "demo")
    assert done.returncode == 1
    announced, said = done.stderr.splitlines()
    assert announced.startswith("1/4 ")
    assert said.startswith("mrbench: a process of the demo ended at once: ")
    assert "rig.toml: cannot be replaced" in said
    assert done.stdout == ""


def test_a_folder_that_cannot_be_made_costs_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    done = mrbench("demo", "--quick", "--out", tmp_path / "file")
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert "cannot be made" in done.stderr

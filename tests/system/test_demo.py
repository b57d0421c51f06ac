"""``mrbench demo`` as a process."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from bench.agent_protocol.link import AgentClient
from bench.agent_protocol.messages import StatusCommand
from bench.config import load_config
from bench.errors import AgentUnreachableError
from bench.log.reader import read_log

pytestmark = pytest.mark.wire
COMMAND = Path(sys.executable).parent / "mrbench"


def mrbench(*arguments):
    return subprocess.run([COMMAND, *map(str, arguments)], capture_output=True, text=True, timeout=280)


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    folder = tmp_path_factory.mktemp("demo") / "quick"
    return mrbench("demo", "--quick", "--out", folder), folder


def test_the_demo_writes_log_fit_report_and_plots(demo):
    result, folder = demo
    assert result.returncode == 0, result.stderr
    assert {"quick.mcap", "fit.json", "report.html", "plots", "bench.toml"} <= {
        path.name for path in folder.iterdir()
    }
    assert len(list((folder / "plots").glob("*.svg"))) == 5


def test_each_step_is_announced_on_standard_error(demo):
    steps = [line for line in demo[0].stderr.splitlines() if line[1:3] == "/4"]
    assert steps == [
        "1/4 start simulated rig, agent, service and worker",
        "2/4 record quick over the wires",
        "3/4 identify the damper",
        "4/4 write the report",
    ]


def test_the_log_was_recorded_over_the_wires_and_is_clean(demo):
    log = read_log(demo[1] / "quick.mcap")
    assert log.outcome == "clean"
    assert "decoders.json" in log.attachments


def test_the_agent_is_shut_down_at_the_end(demo):
    agent = load_config(demo[1] / "bench.toml").agent
    with pytest.raises(AgentUnreachableError):
        AgentClient(agent.commands, agent.samples).send(StatusCommand(), timeout=0.5)


def test_the_printed_numbers_equal_those_of_the_fit(demo):
    result, folder = demo
    fit = json.loads((folder / "fit.json").read_text())
    rmse, floor = fit["rmse_n"]["train"], fit["noise_floor_n"]
    lines = [line.split() for line in result.stdout.splitlines()]
    assert ["fitted", f"{rmse:.2f}", "N", f"{floor:.2f}", "N", f"{rmse / floor:.2f}", "times"] in lines
    rows = {line[0]: line[1:] for line in lines if line}
    for name, estimate in fit["coordinates"].items():
        value = float(rows[name][0].lstrip("([").replace("−", "-")) * (1e-6 if "µm" in rows[name] else 1.0)
        assert value == pytest.approx(estimate["value"], rel=0.05)


def test_the_printed_files_exist(demo):
    result, folder = demo
    named = [Path(word) for word in result.stdout.split() if word.startswith(str(folder))]
    assert len(named) == 4
    assert all(path.exists() for path in named)


def test_the_report_of_the_demo_states_that_its_recording_was_fitted(demo):
    html = (demo[1] / "report.html").read_text()
    assert "fitted to another recording" not in html
    assert "The law reproduces the recorded force" in html


def test_a_failing_process_ends_the_demo_with_its_own_message(tmp_path):
    (tmp_path / "demo" / "rig.toml").mkdir(parents=True)
    result = mrbench("demo", "--quick", "--out", tmp_path / "demo")
    assert result.returncode == 1
    step, message = result.stderr.splitlines()
    assert step.startswith("1/4 ")
    assert message.startswith("mrbench: a process of the demo ended at once: ")
    assert "rig.toml: cannot be replaced" in message
    assert result.stdout == ""


def test_a_folder_that_cannot_be_created_gives_a_one_line_message(tmp_path):
    (tmp_path / "file").write_text("")
    result = mrbench("demo", "--quick", "--out", tmp_path / "file")
    assert result.returncode == 1
    assert result.stderr.count("\n") == 1
    assert "cannot be created" in result.stderr

"""``mrbench demo`` as a process."""

import json
import re
import subprocess
import sys
import time
from pathlib import Path
from urllib.error import URLError
from urllib.request import urlopen

import pytest

from bench.agent_protocol import StatusCommand
from bench.agent_protocol.agent_client import AgentClient
from bench.agent_protocol.endpoint import make_endpoint
from bench.catalogue import Catalogue, make_sqlite_url, open_database
from bench.client import Bench
from bench.config import AgentSection
from bench.errors import AgentUnreachableError
from bench.log.reader import read_log
from bench.report import format_force, format_percent, format_ratio
from bench.samples.store import FOLDER as SAMPLE_FOLDER
from sim_rig.hidden_effect import draw_scenario, make_truth
from tests.support.bench_processes import ENVIRONMENT

pytestmark = [pytest.mark.wire, pytest.mark.timeout(1000)]
COMMAND = Path(sys.executable).parent / "mrbench"
SEED = 1
"""Default seed of the demo."""
PAGE = re.compile(r"http://127\.0\.0\.1:\d+/#token=\S+")
"""Address of the page, with the token."""


def mrbench(*arguments):
    """Return a finished command; one that takes too long is asked to end, so that it stops its own processes."""
    command = [str(COMMAND), *map(str, arguments)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT)
    try:
        output, errors = process.communicate(timeout=900)
    except subprocess.TimeoutExpired:
        process.terminate()
        output, errors = process.communicate(timeout=60)
        raise AssertionError(f"{command} took more than 900 s: {output} {errors}") from None
    return subprocess.CompletedProcess(command, process.returncode, output, errors)


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    folder = tmp_path_factory.mktemp("demo") / "quick"
    return mrbench("demo", "--quick", "--out", folder), folder


def test_the_demo_writes_log_fit_diagnosis_twin_truth_report_and_plots(demo):
    result, folder = demo
    assert result.returncode == 0, result.stderr
    names = {"quick.mcap", "fit.json", "diagnosis.json", "twin.json", "truth.json", "report.html"}
    assert names <= {path.name for path in folder.iterdir()}
    assert len(list((folder / "plots").glob("*.svg"))) >= 5


def test_each_step_is_announced_on_standard_error(demo):
    steps = [line for line in demo[0].stderr.splitlines() if line[1:3] == "/6"]
    assert steps == [
        f"1/6 start simulated rig with a hidden effect (seed {SEED}), agent, service, worker",
        "2/6 record quick over the wires",
        "3/6 identify the damper",
        "4/6 diagnose the sim-to-real gap",
        "5/6 open the truth",
        "6/6 write the report",
    ]


def test_the_address_of_the_page_comes_before_the_first_recording(demo):
    lines = demo[0].stderr.splitlines()
    (place,) = [number for number, line in enumerate(lines) if PAGE.search(line)]
    assert lines[place - 1].startswith("1/6")
    assert lines[place + 1].startswith("2/6")


def test_the_end_says_how_the_page_stays_open(demo):
    last = demo[0].stdout.splitlines()[-1]
    assert "mrbench demo --serve keeps it open, with three recorded runs" in last


def test_the_log_was_recorded_over_the_wires_and_is_clean(demo):
    log = read_log(demo[1] / "quick.mcap")
    assert log.outcome == "clean"
    assert "decoders.json" in log.attachments


def test_the_agent_is_shut_down_at_the_end(demo):
    with pytest.raises(AgentUnreachableError):
        AgentClient(*make_endpoint(AgentSection(), demo[1] / "bench.toml")).send(StatusCommand(), timeout=0.5)


def test_no_job_is_left_unfinished_and_no_folder_half_written(demo):
    data = demo[1] / "service"
    catalogue = Catalogue(open_database(make_sqlite_url(data / "catalogue.db")), data)
    jobs = {job.kind: job.state for job in catalogue.list_jobs(10)}
    catalogue.close()
    assert jobs == {"identify": "done", "diagnose": "done"}
    hidden = [path.name for path in data.iterdir() if path.is_dir() and path.name.startswith(".")]
    assert set(hidden) <= {SAMPLE_FOLDER}


def test_the_printed_numbers_equal_those_of_the_fit(demo):
    result, folder = demo
    fit = json.loads((folder / "fit.json").read_text())
    rmse, floor = fit["rmse_n"]["train"], fit["noise_floor_n"]
    lines = [line.split() for line in result.stdout.splitlines()]
    errors = [format_force(rmse), format_force(floor), format_ratio(rmse / floor)]
    assert ["fitted,", "law", "alone", *" ".join(errors).split()] in lines
    rows = {line[0]: line[1:] for line in lines if len(line) > 1}
    for name, estimate in fit["coordinates"].items():
        value = float(rows[name][0].lstrip("([").replace("−", "-")) * (1e-6 if "µm" in rows[name] else 1.0)
        low, high = estimate["ci95"] or (estimate["value"],) * 2
        # A value has as many digits as its interval justifies.
        assert value == pytest.approx(estimate["value"], rel=0.05, abs=0.5 * (high - low))


def read_statements(result):
    """Return the statements at the end of the demo by their name."""
    lines = (line.strip().partition(": ") for line in result.stdout.splitlines())
    return {name: text for name, separator, text in lines if separator}


def test_the_end_states_what_was_named_and_how_far_the_gap_shrinks(demo):
    result, folder = demo
    diagnosis, said = json.loads((folder / "diagnosis.json").read_text()), read_statements(result)
    for effect in diagnosis["effects"]:
        assert effect["name"].replace("_", " ") in said["Named effect"]
        assert format_percent(diagnosis["probability"]) in said["Named effect"]
        assert format_force(diagnosis["gap"]["before_n"]) in said["Held-out strokes, as expected"]
        assert format_force(diagnosis["gap"]["after_n"]) in said["Held-out strokes, as expected"]


def test_the_end_discloses_the_truth_of_the_seed_and_judges_the_name_by_it(demo):
    result, folder = demo
    truth, said = json.loads((folder / "truth.json").read_text()), read_statements(result)
    named = [effect["name"] for effect in json.loads((folder / "diagnosis.json").read_text())["effects"]]
    assert truth == json.loads(make_truth(draw_scenario(SEED)).model_dump_json(by_alias=True))
    assert said["True effect"].startswith(truth["effect"].replace("_", " "))
    assert said["Drawn by seed"] == str(SEED)
    is_right = "The named effect is the true one" in said
    assert is_right == (named == [truth["effect"]])
    assert is_right or "Wrong" in said or "Partly right" in said
    assert "The hidden effect, disclosed" in (folder / "report.html").read_text()


def test_no_file_but_the_truth_contains_it_and_the_truth_is_opened_last(demo):
    result, folder = demo
    truth = json.loads((folder / "truth.json").read_text())
    log = read_log(folder / "quick.mcap")
    recorded = json.dumps([log.metadata, log.events], default=str) + repr(log.attachments)
    for name in ("rig.log", "service.log", "fit.json"):
        recorded += (folder / name).read_text()
    hidden = [truth["form"], *(repr(parameter["value"]) for parameter in truth["parameters"].values())]
    assert not [word for word in [truth["effect"], *hidden] if word in recorded]
    answer, _, disclosed = result.stdout.partition("Truth, opened only now")
    assert truth["form"].replace("_", " ") in disclosed
    assert truth["meaning"] not in answer


def test_the_printed_files_exist(demo):
    result, folder = demo
    named = [Path(word) for word in result.stdout.split() if word.startswith(str(folder))]
    assert len(named) == 7
    assert all(path.exists() for path in named)


def test_the_report_of_the_demo_states_that_its_recording_was_fitted(demo):
    html = (demo[1] / "report.html").read_text()
    assert "fitted to another recording" not in html
    assert "The law reproduces the recorded force" in html
    assert "Diagnosis of the sim-to-real gap" in html


def test_a_failing_process_ends_the_demo_with_its_own_message(tmp_path):
    (tmp_path / "demo" / "bench.toml").mkdir(parents=True)
    result = mrbench("demo", "--quick", "--out", tmp_path / "demo")
    assert result.returncode == 1
    step, message = result.stderr.splitlines()
    assert step.startswith("1/6 start simulated rig")
    assert message.startswith("mrbench: a process of the demo ended at once: ")
    assert "bench.toml: cannot be replaced" in message
    assert result.stdout == ""


def test_a_truth_file_of_a_person_is_not_replaced(tmp_path):
    (tmp_path / "truth.json").write_text("mine")
    result = mrbench("demo", "--quick", "--out", tmp_path)
    assert result.returncode == 1
    assert "exists and is not a truth file" in result.stderr
    assert (tmp_path / "truth.json").read_text() == "mine"


def test_a_folder_that_cannot_be_created_gives_a_one_line_message(tmp_path):
    (tmp_path / "file").write_text("")
    result = mrbench("demo", "--quick", "--out", tmp_path / "file")
    assert result.returncode == 1
    assert result.stderr.count("\n") == 1
    assert "cannot be created" in result.stderr


@pytest.fixture
def served(tmp_path):
    """Return the process of a demo that keeps serving, and the file with its progress."""
    command = [str(COMMAND), "demo", "--quick", "--serve", "--out", str(tmp_path / "demo")]
    with (tmp_path / "errors").open("w") as errors, (tmp_path / "output").open("w") as output:
        process = subprocess.Popen(command, stdout=output, stderr=errors, env=ENVIRONMENT)
    yield process, tmp_path / "errors"
    if process.poll() is None:
        process.terminate()
        process.wait()


def wait_while_running(process, errors, find):
    """Return what is found as soon as there is something; fail once the process has ended without it."""
    while not (found := find()):
        assert process.poll() is None, errors.read_text()
        time.sleep(0.1)
    return found


def test_a_demo_with_serve_shows_three_runs_until_it_is_terminated(served):
    process, errors = served
    page = wait_while_running(process, errors, lambda: PAGE.search(errors.read_text()))[0]
    with urlopen(page.partition("#")[0]) as answer:
        assert b"mrbench" in answer.read()
    assert not (errors.parent / "demo" / "fit.json").exists()
    wait_while_running(process, errors, lambda: "three runs are recorded" in errors.read_text())
    runs = Bench(page).list_runs()
    assert {run.method for run in runs} == {"quick", "validation", "multisine"}
    assert {run.state for run in runs} == {"ended"}
    process.terminate()
    process.wait()
    assert process.returncode == 0, errors.read_text()
    with pytest.raises(URLError):
        urlopen(page.partition("#")[0])
    assert PAGE.search((errors.parent / "output").read_text())[0] == page

"""Client of the service, against the service itself."""

import json
import os
import time
from urllib.request import Request, urlopen

import numpy as np
import pytest

from bench.catalogue import compute_sha256
from bench.client import Bench, ClientError, RunState
from tests.support.certificates import make_certificate
from tests.support.checks import write_shunt_log
from tests.support.logs import csv_columns, write_csv
from tests.support.service_logs import write_complete_log, write_truncated_log

TIMEOUT = 20.0


def await_run(bench, run_id):
    """Wait until the service has found a log in its data folder."""
    deadline = time.monotonic() + TIMEOUT
    while run_id not in {run.id for run in bench.list_runs()}:
        assert time.monotonic() < deadline
        time.sleep(0.05)
    return bench.run(run_id)


def test_three_lines_return_a_run_as_arrays_with_units(service, bench):
    write_complete_log(service.data / "one.mcap", run="one")
    await_run(bench, "one")
    arrays = Bench(service.url, service.token).run("one").arrays()
    assert np.max(arrays["force"]) == pytest.approx(50.0, rel=1e-3)
    assert arrays["time"][-1] == pytest.approx(1.998)
    assert [arrays.units[name] for name in ("time", "force", "displacement", "velocity", "coil_drive")] == [
        "s", "N", "m", "m/s", "V",
    ]  # fmt: skip
    assert set(arrays) == set(arrays.units)
    assert len({len(values) for values in arrays.values()}) == 1
    assert "1000 samples: time [s]" in repr(arrays)


def test_recordings_of_another_machine_become_a_run(bench, tmp_path):
    columns = csv_columns()
    foreign = {
        "Zeit": 1e3 * columns["time_s"],
        "displacement_m": 1e3 * columns["displacement_m"],
        "force_n": -1e-3 * columns["force_n"],
        "voltage_v": columns["voltage_v"],
    }
    files = [write_csv(tmp_path / name, foreign) for name in ('tag "eins".csv', "zwölf.csv")]
    run = bench.import_files(
        *files,
        specimen="MR-7",
        drive_kind="coil_v",
        columns={"time_s": "Zeit"},
        units={"time_s": "ms", "displacement_m": "mm", "force_n": "kN"},
        reversed_columns=["force_n"],
    )
    state = run.get_state()
    assert (state.specimen, state.state) == ("MR-7", "ended")
    assert "zwölf" in state.method
    arrays = run.arrays()
    count = len(columns["force_n"])
    np.testing.assert_allclose(arrays["force"][:count], columns["force_n"], rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(arrays["displacement"][:count], columns["displacement_m"], rtol=1e-6, atol=1e-9)


def test_a_file_that_is_refused_or_cannot_be_read_is_named(bench, tmp_path):
    path = write_csv(tmp_path / "a.csv", csv_columns())
    with pytest.raises(ClientError, match=r"a\.csv, row 1: no column current_a, whose unit or sense was given"):
        bench.import_files(path, units={"current_a": "mA"})
    with pytest.raises(ClientError, match=r"b\.csv: no such file or directory; nothing was imported"):
        bench.import_files(path, tmp_path / "b.csv")
    assert bench.list_runs() == []


def test_a_run_is_started_watched_and_stopped(service, bench):
    run = bench.start("quick", "damper 7", operator="M. Curie")
    state = run.get_state()
    assert (state.specimen, state.operator, state.method, state.state) == (
        "damper 7",
        "M. Curie",
        "quick",
        "running",
    )
    assert bench.get_state() == "running"
    run.stop()
    assert bench.get_state() == "stopping"
    service.agent.finish("incomplete", "stopped on request")
    ended = run.wait(TIMEOUT)
    assert (ended.state, ended.outcome, ended.reason) == ("ended", "incomplete", "stopped on request")


def test_the_bench_is_stopped_without_the_id_of_a_run(bench):
    bench.start("quick", "damper 7")
    bench.stop()
    assert bench.get_state() == "stopping"


def test_waiting_ends_after_the_given_time(bench):
    run = bench.start("quick", "damper 7")
    with pytest.raises(ClientError, match=rf"run {run.id} has not ended within 0 s; its state is running"):
        run.wait(0.0)


def test_jobs_are_waited_for(service, bench):
    write_complete_log(service.data / "one.mcap", run="one")
    run = await_run(bench, "one")
    with pytest.raises(ClientError, match="has not been evaluated"):
        run.wait_for_jobs(0.0)
    deadline = time.monotonic() + TIMEOUT
    while not (jobs := run.get_state().jobs):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    bench.job(jobs[0].id).cancel()
    assert "cancelled" in {job.state for job in run.wait_for_jobs(TIMEOUT).jobs}


def test_an_ended_run_without_jobs_awaits_its_identification():
    facts = {"id": "one", "method": "quick", "specimen": "", "operator": "", "state": "ended"}
    assert not RunState(**facts, outcome="clean").is_evaluated
    assert RunState(**facts, outcome="incomplete").is_evaluated
    assert RunState(**facts, outcome="clean", source="import").is_evaluated


def test_runs_are_listed_over_several_pages(service, bench, monkeypatch):
    for number in range(5):
        write_complete_log(service.data / f"{number}.mcap", run=f"run-{number}")
    await_run(bench, "run-4")
    monkeypatch.setattr("bench.client.bench._PAGE_SIZE", 2)
    assert sorted(run.id for run in bench.list_runs(50)) == [f"run-{number}" for number in range(5)]
    assert len(bench.list_runs(3)) == 3


def test_methods_are_listed(bench):
    assert "quick" in {method["name"] for method in bench.list_methods()}


def test_a_refusal_has_the_message_status_and_kind_of_the_problem(bench):
    with pytest.raises(ClientError, match="there is no run nothing") as error:
        bench.run("nothing").get_state()
    assert (error.value.status, error.value.kind) == (404, "urn:mrbench:problem:not-found")


def test_a_truncated_log_has_no_arrays(service, bench):
    os.utime(write_truncated_log(service.data / "one.mcap", run="one"), (1.0, 1.0))  # nobody is writing it
    deadline = time.monotonic() + TIMEOUT
    while not (runs := bench.list_runs()):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    with pytest.raises(Exception, match="the log is truncated"):
        bench.run(runs[0].id).arrays()


def test_files_are_downloaded(service, bench, tmp_path):
    log = write_complete_log(service.data / "one.mcap", run="one")
    target = tmp_path / "copies"
    target.mkdir()
    copy = await_run(bench, "one").download_log(target / "copy.mcap")
    assert copy.read_bytes() == log.read_bytes()
    report = bench.run("one").download_report(target / "report.html")
    assert report.read_text().startswith("<!doctype html>")
    with pytest.raises(ClientError, match="there is no run two"):
        bench.run("two").download_report(target / "none.html")


def test_a_signed_report_is_listed_and_downloaded_byte_by_byte(service, bench, tmp_path):
    write_complete_log(service.data / "one.mcap", run="one")
    run = await_run(bench, "one")
    assert run.list_signatures() == []
    kept = bench._session.post("/runs/one/report/copies", {"format": "pdf"})
    sign_as_person(
        service, bench, "/runs/one/report/signatures", {"sha256": kept["sha256"], "meaning": "approved"}
    )
    (signed,) = run.list_signatures()
    assert (signed["full_name"], signed["meaning"], signed["file"]) == ("Marie Curie", "approved", "intact")
    file = run.download_signed_report(signed["sha256"], tmp_path / "signed.pdf")
    assert file.read_bytes().startswith(b"%PDF-")
    assert compute_sha256(file) == signed["sha256"]


def sign_as_person(service, bench, path, content):
    person = {"name": "mcurie", "password": "radium and polonium"}
    bench._session.post("/users", {**person, "full_name": "Marie Curie", "role": "engineer"})

    def send(path, content, **headers):
        body, given = json.dumps(content).encode(), {"Content-Type": "application/json", **headers}
        return urlopen(Request(f"{service.url}/api/v1{path}", body, given, method="POST"))

    with send("/session", person) as answer:
        cookie, csrf = answer.headers["Set-Cookie"].partition(";")[0], json.load(answer)["csrf"]
    with send(
        path, {**content, "password": person["password"]}, Cookie=cookie, **{"X-CSRF-Token": csrf}
    ) as answer:
        assert answer.status == 201


def test_certificates_are_added_corrected_and_withdrawn(bench):
    added = bench.add_certificate(make_certificate())
    corrected = bench.correct_certificate(added["id"], "typing error", note="second cell")
    assert (corrected["version"], corrected["document"]["note"]) == (2, "second cell")
    assert bench.withdraw_certificate(added["id"], "cell & cable replaced")["state"] == "withdrawn"
    assert [one["withdrawal"]["reason"] for one in bench.list_certificates("force")] == ["cell & cable replaced"]
    assert bench.list_certificates("coil_current") == []


@pytest.mark.parametrize("kind", ["zero", "shunt"])
def test_a_check_is_started_by_its_kind(service, bench, kind):
    start = {"zero": bench.start_zero_check, "shunt": bench.start_shunt_check}[kind]
    start("none", "M. Curie")
    command = service.agent.commands[-1]
    assert (command.method["name"], command.specimen, command.operator) == (f"{kind}_check", "none", "M. Curie")


def test_shunt_checks_are_listed_and_charted_by_their_name(service, bench):
    write_shunt_log(service.data / "shunt-1.mcap", "shunt-1")
    await_run(bench, "shunt-1")
    deadline = time.monotonic() + TIMEOUT
    while not (records := bench.list_checks("force", check="shunt")):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    assert [one["run"] for one in records] == ["shunt-1"]
    assert bench.list_checks("force") == []
    assert bench.get_check_chart("force", check="shunt")["count"] == 1
    assert bench.begin_check_baseline("force", "repair", check="shunt")["count"] == 0
